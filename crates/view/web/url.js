/**
 * The view and its settings in the part of the address after `#`, so that a link shows what its sender saw. Positions are in
 * the scene's coordinates and angles in degrees, as the command line has them (`--eye`, `--fov`). What cannot be understood is
 * left out, since a link may have lost its end in a letter; what is at its default is not written.
 */

import { anglesOf, frameOf, MAX_FOV, MIN_FOV } from "twinray/camera.js";
import { DEFAULTS } from "twinray/settings.js";
import { add, dot, length, normalize, sub } from "twinray/vec.js";

/** @import { Pose, Values, Vec3, Walk } from "twinray/types.js" */
/** @typedef {{ pose: Pose | null, distance: number | null, values: Partial<Values> }} Linked */

/** Times between two writes; browsers refuse a page that rewrites its address more often than some hundred times in half a minute. */
const WRITE_MILLISECONDS = 250;

const DEGREES = 180 / Math.PI;

/** @type {(x: number, decimals: number) => string} */
const fixed = (x, decimals) => String(Number(x.toFixed(decimals)) || 0);

/**
 * The hash, without `#`, of a view.
 * @param {Walk} walk
 * @param {Pose} pose
 * @param {number} distance
 * @param {Values} values
 */
export function format(walk, pose, distance, values) {
    // A millionth of the scene's size is far below a pixel.
    const decimals = Math.min(Math.max(Math.ceil(6 - Math.log10(walk.radius)), 0), 12);
    /** @type {(v: Vec3, decimals: number) => string} */
    const triple = (v, decimals) => v.map((x) => fixed(x, decimals)).join(",");
    /** @type {string[]} */
    const parts = [];
    parts.push(`eye=${triple(add(pose.eye, walk.centre), decimals)}`);
    parts.push(`forward=${triple(pose.forward, 6)}`);
    const level = frameOf({ ...anglesOf(pose), roll: 0 }).up;
    if (dot(level, pose.up) < 1 - 1e-7 || Math.abs(pose.forward[1]) > 0.9999) parts.push(`up=${triple(pose.up, 6)}`);
    parts.push(`distance=${fixed(distance, decimals)}`, `fov=${fixed(pose.fov * DEGREES, 3)}`);
    // What one starts with depends on the scene, so that none is the default.
    parts.push(`mode=${values.mode}`);
    if (values.speed !== DEFAULTS.speed) parts.push(`speed=${fixed(values.speed, 3)}`);
    if (values.exposure !== null) parts.push(`exposure=${fixed(values.exposure, 3)}`);
    if (values.curve !== DEFAULTS.curve) parts.push(`tone=${values.curve}`);
    if (values.falseColour) parts.push("false-colour=1");
    if (values.range) parts.push(`range=${values.range.map((x) => Number(x.toPrecision(6))).join(",")}`);
    if (values.logarithmic !== DEFAULTS.logarithmic) parts.push("scale=linear");
    if (values.map !== DEFAULTS.map) parts.push(`map=${values.map}`);
    if (values.cells) parts.push("cells=1");
    return parts.join("&");
}

/**
 * What a hash says, with or without `#`.
 * @param {Walk} walk
 * @param {string} hash
 * @returns {Linked}
 */
export function parse(walk, hash) {
    const fields = new URLSearchParams(hash.replace(/^#/, ""));
    /** @type {(name: string, count: number) => number[] | null} */
    const numbers = (name, count) => {
        const parts = (fields.get(name) ?? "").split(",");
        const found = parts.map((part) => (/\d/.test(part) ? Number(part) : NaN));
        return found.length === count && found.every((x) => Number.isFinite(x) && Math.abs(x) < 1e12) ? found : null;
    };
    /** @type {(name: string) => Vec3 | null} */
    const vector = (name) => /** @type {Vec3 | null} */ (numbers(name, 3));
    /** @type {(name: string, low: number, high: number) => number | null} */
    const number = (name, low, high) => {
        const found = numbers(name, 1);
        return found && found[0] >= low && found[0] <= high ? found[0] : null;
    };
    /** @type {<T extends string>(name: string, allowed: T[]) => T | undefined} */
    const word = (name, allowed) => allowed.find((candidate) => candidate === fields.get(name));

    /** @type {Partial<Values>} */
    const values = {};
    values.mode = word("mode", ["orbit", "fly"]);
    values.curve = word("tone", ["agx", "aces", "reinhard", "none"]);
    values.map = word("map", ["turbo", "viridis"]);
    values.speed = number("speed", 0.05, 20) ?? undefined;
    values.exposure = number("exposure", -60, 60) ?? undefined;
    const range = numbers("range", 2);
    if (range && range[0] >= 0 && range[1] > range[0]) values.range = [range[0], range[1]];
    if (fields.get("false-colour") === "1") values.falseColour = true;
    if (fields.get("scale") === "linear") values.logarithmic = false;
    if (fields.get("cells") === "1") values.cells = true;
    for (const name of /** @type {(keyof Values)[]} */ (Object.keys(values))) {
        if (values[name] === undefined) delete values[name];
    }

    const [eye, forward, fov] = [vector("eye"), vector("forward"), number("fov", 1, 170)];
    /** @type {Pose | null} */
    let pose = null;
    if (eye && forward && length(forward) > 1e-6) {
        const ahead = normalize(forward);
        const up = vector("up") ?? [0, 1, 0];
        const frame = frameOf(anglesOf({ forward: ahead, up: length(up) > 1e-6 ? normalize(up) : [0, 1, 0] }));
        const angle = fov === null ? Math.PI / 4 : Math.min(Math.max(fov / DEGREES, MIN_FOV), MAX_FOV);
        pose = { eye: sub(eye, walk.centre), forward: ahead, up: frame.up, fov: angle };
    }
    return { pose, distance: number("distance", 1e-12, 1e12), values };
}

/** Writes the hash while its owner moves, some times a second and never while nothing changes. */
export class AddressWriter {
    #format;
    /** @type {ReturnType<typeof setTimeout> | null} */
    #timer = null;
    #written = "";

    /** @param {() => string} format the hash as it now should be */
    constructor(format) {
        this.#format = format;
    }

    /** What was last written, to know one's own change from that of a visitor. */
    get written() {
        return this.#written;
    }

    /** Something changed; it is written soon. */
    schedule() {
        this.#timer ??= setTimeout(() => this.flush(), WRITE_MILLISECONDS);
    }

    /** Writes at once. */
    flush() {
        if (this.#timer !== null) clearTimeout(this.#timer);
        this.#timer = null;
        const hash = `#${this.#format()}`;
        if (hash === this.#written) return;
        this.#written = hash;
        try {
            history.replaceState(null, "", hash);
        } catch {
            // A page opened in a sandboxed frame may not change its address; then links are copied as they are formatted.
        }
    }
}
