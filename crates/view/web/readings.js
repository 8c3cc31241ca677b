/**
 * Readings: points of the scene that a visitor asks for the light of. Each has a mark in the picture that stays on its point,
 * and one has its card open. While the solve goes on they are read again.
 */

import { announce, element } from "twinray/announce.js";
import { number, percent, plusMinus, quantity } from "twinray/colours.js";
import { copy } from "twinray/screenshot.js";
import { add, length, sub } from "twinray/vec.js";

/** @import { Camera } from "twinray/camera.js" */
/** @import { Pick, Vec3, Walk } from "twinray/types.js" */
/** @typedef {{ number: number, pick: Pick, eye: Vec3, mark: HTMLButtonElement }} Reading */
/** @typedef {(x: number, y: number) => Promise<Pick | null>} Picker */

/** More marks than this hide the scene. */
const MOST = 50;
/** Nearer than this to the right edge, a mark has its words on the left; in pixels. */
const EDGE = 100;
/** Rec. 709, as the solver weighs colours. @type {Vec3} */
const LUMINANCE = [0.2126, 0.7152, 0.0722];

export class Readings {
    #walk;
    #camera;
    #canvas;
    #picker;
    /** @type {Reading[]} */
    #all = [];
    /** @type {Reading | null} */
    #open = null;
    #next = 1;
    #reading = false;
    #again = false;
    #hovering = false;

    /**
     * @param {Walk} walk
     * @param {Camera} camera
     * @param {HTMLCanvasElement} canvas
     * @param {Picker} picker in CSS pixels
     */
    constructor(walk, camera, canvas, picker) {
        this.#walk = walk;
        this.#camera = camera;
        this.#canvas = canvas;
        this.#picker = picker;
        if (walk.unit.name !== "lx") element("reading-luminance-name").textContent = "Radiance";
        element("reading-close").addEventListener("click", () => this.closeOne());
        element("reading-clear").addEventListener("click", () => this.clear());
        element("reading-copy").addEventListener("click", () => copy(this.table(), "Readings copied"));
    }

    get count() {
        return this.#all.length;
    }

    /** Reads the light at a place of the picture and keeps it. @param {number} x @param {number} y */
    async take(x, y) {
        const { eye } = this.#camera.pose;
        const pick = await this.#picker(x, y);
        if (!pick) return announce("Nothing there");
        const mark = document.createElement("button");
        mark.type = "button";
        /** @type {Reading} */
        const reading = { number: this.#next++, pick, eye, mark };
        mark.append(document.createElement("span"));
        mark.addEventListener("click", () => this.#show(reading));
        element("markers").append(mark);
        this.#all.push(reading);
        if (this.#all.length > MOST) this.#remove(this.#all[0]);
        this.#label(reading);
        this.#show(reading);
        this.place();
        const error = Number.isFinite(pick.error) ? `, plus or minus ${percent(pick.error)}` : "";
        announce(`Reading ${reading.number}: ${this.#illuminance(pick)}${error}, ${pick.material}`);
    }

    /** Says beside the cursor what a click would read. @param {{ x: number, y: number } | null} place */
    async hover(place) {
        const note = element("hover");
        if (place === null) {
            note.hidden = true;
            return;
        }
        // One question at a time: a cursor is faster than a slow machine's answers.
        if (this.#hovering) return;
        this.#hovering = true;
        const pick = await this.#picker(place.x, place.y).finally(() => (this.#hovering = false));
        note.hidden = pick === null || document.body.dataset.picking !== "true";
        if (!pick) return;
        note.textContent = this.#illuminance(pick);
        const right = place.x + 16 + note.offsetWidth > this.#canvas.clientWidth ? -16 - note.offsetWidth : 16;
        note.style.transform = `translate(${place.x + right}px, ${Math.max(place.y - 34, 4)}px)`;
    }

    /** Puts all marks where their points are in the picture. */
    place() {
        const [width, height] = [this.#canvas.clientWidth, this.#canvas.clientHeight];
        for (const { pick, mark } of this.#all) {
            const at = this.#camera.project(pick.point);
            mark.hidden = at === null || Math.abs(at[0]) > 1 || Math.abs(at[1]) > 1;
            if (!at) continue;
            const [x, y] = [(at[0] + 1) * 0.5 * width, (1 - at[1]) * 0.5 * height];
            mark.style.transform = `translate(${x}px, ${y}px)`;
            mark.dataset.flip = String(x > width - EDGE);
        }
    }

    /** Reads again those that are in sight, in the light as it is now, and dims those that something hides. */
    async refresh() {
        if (this.#reading) {
            this.#again = true;
            return;
        }
        this.#reading = true;
        try {
            for (const reading of [...this.#all]) {
                const at = this.#camera.project(reading.pick.point);
                if (!at || Math.abs(at[0]) > 1 || Math.abs(at[1]) > 1) continue;
                const before = this.#camera.pose;
                const [x, y] = [
                    (at[0] + 1) * 0.5 * this.#canvas.clientWidth,
                    (1 - at[1]) * 0.5 * this.#canvas.clientHeight,
                ];
                const pick = await this.#picker(x, y);
                // An answer that comes when the camera is elsewhere is one about another point.
                if (this.#camera.pose !== before) continue;
                const far = length(sub(reading.pick.point, before.eye));
                reading.mark.dataset.behind = String(pick !== null && pick.distance < 0.99 * far);
                if (!pick || pick.cell !== reading.pick.cell || Math.abs(pick.distance - far) > 0.01 * far) continue;
                const { point, distance, radiance } = reading.pick;
                // Radiance towards the eye is that of where it was read, unless the eye is still there.
                const moved = length(sub(this.#camera.pose.eye, reading.eye)) > 0;
                reading.pick = { ...pick, point, distance, radiance: moved ? radiance : pick.radiance };
                this.#label(reading);
                if (reading === this.#open) this.#fill(reading);
            }
        } finally {
            this.#reading = false;
        }
        if (this.#again) {
            this.#again = false;
            await this.refresh();
        }
    }

    /** The marks that can be seen, for a picture that is saved: pixels and words. */
    get marks() {
        return this.#all
            .filter(({ mark }) => !mark.hidden && mark.dataset.behind !== "true")
            .map(({ pick }) => {
                const [x, y] = this.#camera.project(pick.point) ?? [NaN, NaN];
                return { x: (x + 1) / 2, y: (1 - y) / 2, text: this.#illuminance(pick) };
            });
    }

    /** Removes the reading whose card is open; whether there was one. */
    closeOne() {
        if (!this.#open) return false;
        this.#remove(this.#open);
        this.#show(this.#all.at(-1) ?? null);
        return true;
    }

    clear() {
        for (const reading of [...this.#all]) this.#remove(reading);
        this.#next = 1;
        this.#show(null);
    }

    /** All readings as a table for a spreadsheet: columns between tabs. */
    table() {
        const { name, factor } = this.#walk.unit;
        const seen = name === "lx" ? "luminance cd/m²" : "radiance W/(m² sr)";
        const rows = this.#all.map(({ number: index, pick }) => [
            index,
            pick.illuminance.toPrecision(5),
            Number.isFinite(pick.error) ? pick.error.toPrecision(3) : "",
            (luminance(pick.radiance) * factor).toPrecision(5),
            pick.material,
            ...add(pick.point, this.#walk.centre).map((x) => x.toFixed(4)),
        ]);
        const head = ["reading", `${this.#name()} ${name}`, "relative error", seen, "material", "x", "y", "z"];
        return [head, ...rows].map((row) => row.join("\t")).join("\n");
    }

    /** @param {Reading} reading */
    #remove(reading) {
        reading.mark.remove();
        this.#all = this.#all.filter((other) => other !== reading);
        if (this.#open === reading) this.#open = null;
    }

    /** @param {Reading | null} reading */
    #show(reading) {
        this.#open = reading;
        for (const { mark } of this.#all) mark.setAttribute("aria-current", String(mark === reading?.mark));
        element("reading").hidden = reading === null;
        document.body.dataset.reading = reading ? "open" : "closed";
        if (!reading) return;
        this.#fill(reading);
        // The card keeps clear of the point that it is about: at the other end where it is as wide as the picture, else beside.
        const at = this.#camera.project(reading.pick.point) ?? [0, 0];
        const corner = (at[0] + 1) * this.#canvas.clientWidth < 640 && (1 - at[1]) * this.#canvas.clientHeight < 480;
        document.body.dataset.readingSide = at[1] < 0 ? "top" : "bottom";
        document.body.dataset.readingEdge = corner ? "right" : "left";
    }

    /** @param {Reading} reading */
    #label({ number: index, pick, mark }) {
        mark.setAttribute("aria-label", `Reading ${index}: ${this.#illuminance(pick)}`);
        /** @type {HTMLElement} */ (mark.firstElementChild).textContent = this.#illuminance(pick);
    }

    /** @param {Reading} reading */
    #fill({ number: index, pick }) {
        const { name, factor } = this.#walk.unit;
        element("reading-title").textContent = `Reading ${index}`;
        element("reading-value").textContent = this.#illuminance(pick);
        element("reading-error").textContent = plusMinus(pick.error);
        element("reading-material").textContent = pick.material;
        const unit = name === "lx" ? "cd/m²" : "W/(m²·sr)";
        element("reading-luminance").textContent = quantity(luminance(pick.radiance) * factor, unit);
        const decimals = Math.min(Math.max(Math.ceil(3 - Math.log10(this.#walk.radius)), 0), 6);
        const position = add(pick.point, this.#walk.centre).map((x) => x.toFixed(decimals).replace("-", "−"));
        element("reading-position").textContent = position.join(", ");
        element("reading-distance").textContent = number(pick.distance);
    }

    #name() {
        return this.#walk.unit.name === "lx" ? "illuminance" : "irradiance";
    }

    /** @param {Pick} pick */
    #illuminance(pick) {
        return quantity(pick.illuminance, this.#walk.unit.name);
    }
}

/** @param {Vec3} rgb */
const luminance = (rgb) => rgb[0] * LUMINANCE[0] + rgb[1] * LUMINANCE[1] + rgb[2] * LUMINANCE[2];
