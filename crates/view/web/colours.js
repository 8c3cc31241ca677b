/**
 * Colours for illuminance, and how quantities are written: numbers with units as a lighting report has them.
 */

/** @import { MapName } from "twinray/types.js" */

/**
 * Polynomials of degree 5 and 6 in `t` from 0 to 1, per channel from the constant upwards, that give sRGB.
 * turbo: A. Mikhailov, "Turbo, An Improved Rainbow Colormap for Visualization", Google AI Blog, 2019; fit by R. Du. It tells
 * the most levels apart, and its lightness rises and falls only once. (gist.github.com/mikhailov-work/0d177465a8151eb6)
 * viridis: S. van der Walt and N. Smith, matplotlib, 2015; fit by M. Zucker (CC0). Its lightness rises evenly, which holds for
 * colour-blind eyes and grey prints too.
 * @type {Record<MapName, number[][]>}
 */
const POLYNOMIALS = {
    turbo: [
        [0.13572138, 4.6153926, -42.66032258, 132.13108234, -152.94239396, 59.28637943],
        [0.09140261, 2.19418839, 4.84296658, -14.18503333, 4.27729857, 2.82956604],
        [0.1066733, 12.64194608, -60.58204836, 110.36276771, -89.90310912, 27.34824973],
    ],
    viridis: [
        [0.2777273272, 0.1050930431, -0.3308618287, -4.634230499, 6.2282699363, 4.7763849977, -5.4354558559],
        [0.0054073445, 1.4046135299, 0.2148475595, -5.7991009734, 14.1799333668, -13.7451453777, 4.6458526122],
        [0.3340998053, 1.3845901626, 0.095095163, -19.332440956, 56.6905506007, -65.3530326334, 26.3124352496],
    ],
};

/**
 * A colour map as the renderer and the legend take it, `[256, 4]`, sRGB.
 * @param {MapName} name
 */
export function colourTable(name) {
    const table = new Uint8Array(256 * 4);
    for (let i = 0; i < 256; i++) {
        POLYNOMIALS[name].forEach((coefficients, channel) => {
            const value = coefficients.reduceRight((sum, c) => sum * (i / 255) + c, 0);
            table[4 * i + channel] = Math.round(255 * Math.min(Math.max(value, 0), 1));
        });
        table[4 * i + 3] = 255;
    }
    return table;
}

/**
 * A number with `digits` significant digits and grouped thousands; very large and very small ones with a power of ten.
 * @param {number} x
 */
export function number(x, digits = 3) {
    if (!Number.isFinite(x)) return "–";
    if (x === 0) return "0";
    const exponent = Math.floor(Math.log10(Math.abs(x)));
    if (exponent < -4 || exponent > 8) {
        const [mantissa, power] = x.toExponential(digits - 1).split("e");
        return `${sign(mantissa)} × 10${superscript(Number(power))}`;
    }
    const text = new Intl.NumberFormat("en", { maximumSignificantDigits: digits }).format(x);
    return sign(text);
}

/** @param {number} x @param {string} unit */
export const quantity = (x, unit, digits = 3) => `${number(x, digits)} ${unit}`;

/** A relative error, as `± 2.1 %`; empty where it is not known. @param {number} error */
export const plusMinus = (error) => (Number.isFinite(error) ? `± ${percent(error)}` : "");

/** @param {number} x */
export const percent = (x) => (Number.isFinite(x) ? `${number(100 * x, 2)} %` : "–");

/** A count, as `12.3 M`. @param {number} x */
export function count(x) {
    if (!Number.isFinite(x)) return "–";
    for (const [size, name] of /** @type {[number, string][]} */ ([
        [1e12, "T"],
        [1e9, "G"],
        [1e6, "M"],
        [1e4, "k"],
    ])) {
        if (x >= size) return `${number(x / (name === "k" ? 1e3 : size))} ${name}`;
    }
    return number(Math.round(x), 5);
}

/** A duration, as `1 h 05 min`, `3 min 20 s` or `12 s`. @param {number} seconds */
export function duration(seconds) {
    if (!Number.isFinite(seconds)) return "–";
    const whole = Math.round(seconds);
    const [h, m, s] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
    const two = (/** @type {number} */ x) => String(x).padStart(2, "0");
    if (h > 0) return `${h} h ${two(m)} min`;
    return m > 0 ? `${m} min ${two(s)} s` : `${s} s`;
}

/** Exposure in stops, with its sign. @param {number} ev */
export const stops = (ev) => `${ev < -0.004 ? "−" : "+"}${Math.abs(ev).toFixed(1)} EV`;

/** @param {string} text */
const sign = (text) => text.replace(/^-/, "−");

/** @param {number} power */
const superscript = (power) => String(power).replace(/[-\d]/g, (digit) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(digit)]);
