/**
 * What the visitor's settings mean to the renderer and to the legend: pure functions between the two.
 */

import { colourTable } from "twinray/colours.js";

/** @import { Scale } from "twinray/legend.js" */
/** @import { Options, Pose, Values, Walk } from "twinray/types.js" */

/** Of a range that starts from nothing, a logarithmic scale shows three decades. */
const DECADES = 1e-3;

/** @param {[number, number]} range @returns {[number, number]} */
const positive = ([low, high]) => [low > 0 ? low : high * DECADES, high];

/**
 * The renderer's options among what has changed.
 * @param {Values} values
 * @param {Partial<Values>} changed
 * @returns {Partial<Options>}
 */
export function rendererOptions(
    { range, logarithmic },
    { map, mode: _mode, speed: _speed, picking: _picking, ...options },
) {
    if ("range" in options || "logarithmic" in options) options.range = range && logarithmic ? positive(range) : range;
    return map ? { ...options, colours: colourTable(map) } : options;
}

/**
 * The scale of the colours in use; null without false colours.
 * @param {Values} values
 * @param {[number, number] | null} automatic the range that the renderer has chosen, if it has drawn
 * @param {Walk["unit"]} unit
 * @returns {Scale | null}
 */
export function colourScale({ falseColour, range, logarithmic, map }, automatic, unit) {
    const inUse = range ?? automatic;
    if (!falseColour || !inUse) return null;
    const [low, high] = logarithmic ? positive(inUse) : inUse;
    return { low, high, logarithmic, unit: unit.name, colours: colourTable(map) };
}

/**
 * A room is looked at from within, a thing from around it.
 * @param {Walk} walk
 * @param {Pose} home
 */
export function naturalMode({ bounds: [low, high] }, { eye }) {
    return eye.every((x, i) => x > low[i] && x < high[i]) ? "fly" : "orbit";
}
