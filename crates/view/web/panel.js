/**
 * The panel's controls, bound both ways to the settings and the camera. What they do to the picture is not decided here.
 */

import { cameraName, cameraNote } from "twinray/actions.js";
import { element } from "twinray/announce.js";
import { samePose } from "twinray/camera.js";
import { count, number, stops } from "twinray/colours.js";

/** @import { Camera } from "twinray/camera.js" */
/** @import { Actions } from "twinray/actions.js" */
/** @import { Settings } from "twinray/settings.js" */
/** @import { Curve, MapName, Mode, Values, Walk } from "twinray/types.js" */

const DEGREES = 180 / Math.PI;
/** Stops that the slider reaches to either side of automatic exposure. */
const EXPOSURE_REACH = 8;

/** @param {string} id @returns {HTMLInputElement} */
const input = (id) => /** @type {HTMLInputElement} */ (element(id));

/** @param {string} id @returns {HTMLSelectElement} */
const select = (id) => /** @type {HTMLSelectElement} */ (element(id));

export class Panel {
    #walk;
    #camera;
    #settings;
    /** The middle of the exposure slider. */
    #middle = NaN;
    /** The range in use, which stands in the fields while it is automatic. @type {[number, number]} */
    #range = [0, 1];
    /** @type {HTMLButtonElement[]} */
    #cameras = [];

    /**
     * @param {Walk} walk
     * @param {Camera} camera
     * @param {Settings} settings
     * @param {Actions} act
     */
    constructor(walk, camera, settings, act) {
        this.#walk = walk;
        this.#camera = camera;
        this.#settings = settings;
        this.#describe();
        this.#listCameras(act);
        this.#bindButtons(act);
        this.#bindSettings();
        settings.listen((values, changed) => this.#show(values, changed));
        this.moved();
    }

    /** The camera has moved. */
    moved() {
        const { pose, destination } = this.#camera;
        const fov = Math.round(pose.fov * DEGREES);
        input("fov").value = String(fov);
        element("fov-value").textContent = `${fov}°`;
        input("fov").setAttribute("aria-valuetext", `${fov} degrees`);
        this.#cameras.forEach((button, i) => {
            const here = samePose(this.#walk.cameras[i], destination, this.#walk.radius);
            if (here) button.setAttribute("aria-current", "true");
            else button.removeAttribute("aria-current");
        });
    }

    /**
     * What the renderer uses, where it was left to choose.
     * @param {number} exposure
     * @param {[number, number]} range
     */
    inUse(exposure, range) {
        if (Number.isNaN(this.#middle) || this.#settings.values.exposure === null) this.#middle = Math.round(exposure);
        this.#showExposure(exposure);
        this.#range = range;
        if (this.#settings.values.range === null) this.#showRange(range);
    }

    #describe() {
        const { name, stats, generator, unit } = this.#walk;
        document.title = `${name} – twinray`;
        element("scene-name").textContent = element("scene-name").title = name;
        element("scene-stats").textContent = `${count(stats.triangles)} triangles · ${count(stats.cells)} cells`;
        element("view").setAttribute("aria-label", `View of ${name}`);
        element("generator").textContent = generator;
        element("range-unit").textContent = unit.name;
        element("h-illuminance").textContent = unit.name === "lx" ? "Illuminance" : "Irradiance";
    }

    /** The cameras of the scene; home has its own button beside the picture. @param {Actions} act */
    #listCameras(act) {
        element("cameras").hidden = this.#walk.cameras.length === 0;
        this.#cameras = this.#walk.cameras.map((_, i) => {
            const button = document.createElement("button");
            button.type = "button";
            button.textContent = cameraName(this.#walk, i);
            const note = cameraNote(this.#walk, i);
            button.title = `${button.textContent}${i < 9 ? ` (${i + 1})` : ""}${note && `: ${note}`}`;
            button.addEventListener("click", () => act.camera(i));
            return button;
        });
        element("cameras").append(...this.#cameras);
    }

    /** @param {Actions} act */
    #bindButtons(act) {
        /** @type {[string, string, string, () => void][]} */
        const tools = [
            ["tool-pick", "Take readings", "R", act.picking],
            ["tool-home", "Home", "H", act.home],
            ["tool-screenshot", "Save the picture", "G", act.screenshot],
            ["tool-link", "Copy a link to this view", "U", act.link],
            ["tool-fullscreen", "Full screen", "F", act.fullscreen],
            ["tool-help", "Keys and gestures", "?", act.help],
            ["tool-panel", "Panel", "P", act.panel],
        ];
        for (const [id, says, key, run] of tools) {
            const button = element(id);
            button.setAttribute("aria-label", says);
            button.setAttribute("aria-keyshortcuts", key);
            button.title = `${says} (${key})`;
            button.addEventListener("click", run);
        }
        element("pick").addEventListener("click", act.picking);
        element("solve-toggle").addEventListener("click", act.pause);
        element("help-close").addEventListener("click", act.help);
        // A browser without full screen (a telephone's) shall not offer it.
        element("tool-fullscreen").hidden = !document.fullscreenEnabled;
        document.addEventListener("fullscreenchange", () =>
            element("tool-fullscreen").setAttribute("aria-pressed", String(document.fullscreenElement !== null)),
        );
    }

    #bindSettings() {
        const settings = this.#settings;
        /** @type {(id: string, run: () => void) => void} */
        const on = (id, run) => element(id).addEventListener("input", run);
        on("mode", () => settings.set({ mode: /** @type {Mode} */ (checked("mode")) }));
        on("fov", () => this.#camera.setFov(Number(input("fov").value) / DEGREES));
        on("speed", () => settings.set({ speed: 2 ** Number(input("speed").value) }));
        on("exposure", () => settings.set({ exposure: Number(input("exposure").value) }));
        on("exposure-auto", () =>
            settings.set({ exposure: input("exposure-auto").checked ? null : Number(input("exposure").value) }),
        );
        on("curve", () => settings.set({ curve: /** @type {Curve} */ (select("curve").value) }));
        on("false-colour", () => settings.set({ falseColour: input("false-colour").checked }));
        on("range-auto", () => settings.set({ range: input("range-auto").checked ? null : this.#range }));
        for (const id of ["range-low", "range-high"]) element(id).addEventListener("change", () => this.#typedRange());
        on("scale", () => settings.set({ logarithmic: checked("scale") === "log" }));
        on("map", () => settings.set({ map: /** @type {MapName} */ (select("map").value) }));
        on("cells", () => settings.set({ cells: input("cells").checked }));
    }

    #typedRange() {
        const [low, high] = [parseNumber(input("range-low").value), parseNumber(input("range-high").value)];
        input("range-low").setAttribute("aria-invalid", String(!(low >= 0)));
        input("range-high").setAttribute("aria-invalid", String(!(high > 0 && !(high <= low))));
        if (low >= 0 && high > low) this.#settings.set({ range: [low, high] });
    }

    /** @param {Values} values @param {Partial<Values>} changed */
    #show(values, changed) {
        check("mode", values.mode);
        const speed = Math.log2(values.speed);
        input("speed").value = String(speed);
        element("speed-value").textContent = `× ${number(values.speed, 2)}`;
        input("speed").setAttribute("aria-valuetext", `times ${number(values.speed, 2)}`);
        input("exposure-auto").checked = values.exposure === null;
        if (values.exposure !== null) this.#showExposure(values.exposure);
        select("curve").value = values.curve;
        input("false-colour").checked = values.falseColour;
        element("false-colour-options").hidden = !values.falseColour;
        input("range-auto").checked = values.range === null;
        if ("range" in changed) this.#showRange(values.range ?? this.#range);
        check("scale", values.logarithmic ? "log" : "linear");
        select("map").value = values.map;
        input("cells").checked = values.cells;
        for (const id of ["pick", "tool-pick"]) element(id).setAttribute("aria-pressed", String(values.picking));
        element("pick").textContent = values.picking ? "Taking readings: click a point" : "Take readings";
        document.body.dataset.picking = String(values.picking);
    }

    /** @param {number} exposure */
    #showExposure(exposure) {
        const slider = input("exposure");
        const middle = Number.isNaN(this.#middle) ? 0 : this.#middle;
        slider.min = String(Math.min(middle - EXPOSURE_REACH, Math.floor(exposure)));
        slider.max = String(Math.max(middle + EXPOSURE_REACH, Math.ceil(exposure)));
        slider.value = String(exposure);
        element("exposure-value").textContent = stops(exposure);
        slider.setAttribute("aria-valuetext", stops(exposure).replace("EV", "stops"));
    }

    /** @param {[number, number]} range */
    #showRange(range) {
        ["range-low", "range-high"].forEach((id, i) => {
            // What is being typed is not overwritten by light that arrives.
            if (document.activeElement === element(id)) return;
            input(id).value = String(Number(range[i].toPrecision(3)));
            input(id).setAttribute("aria-invalid", "false");
        });
    }
}

/** A number as people type it: with a comma, thousands apart, or its unit behind it. @param {string} text */
export function parseNumber(text) {
    const plain = text
        .trim()
        .replace(/\s*(lx|lux|W\/m²|W\/m2)$/i, "")
        .replace(/[\s\u2009\u00a0']/g, "");
    if (plain === "") return NaN;
    // 1,200 is a thousand and more; 1,2 and 0,125 are not.
    if (/^[1-9]\d{0,2}(,\d{3})+(\.\d*)?$/.test(plain)) return Number(plain.replaceAll(",", ""));
    return Number(plain.replace(",", "."));
}

/** The value of the radio button that is on. @param {string} name */
const checked = (name) => document.querySelector(`input[name="${name}"]:checked`)?.getAttribute("value") ?? "";

/** @param {string} name @param {string} value */
function check(name, value) {
    const button = document.querySelector(`input[name="${name}"][value="${value}"]`);
    if (button instanceof HTMLInputElement) button.checked = true;
}
