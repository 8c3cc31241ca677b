/**
 * The legend of the false colours: ticks at round numbers, on the page and in pictures that are saved.
 */

import { element } from "twinray/announce.js";
import { number } from "twinray/colours.js";

/** @typedef {{ low: number, high: number, logarithmic: boolean, unit: string, colours: Uint8Array }} Scale */
/** @typedef {{ at: number, text: string }} Tick position from 0 to 1 and its label */

const MOST_TICKS = 6;
/** The share of the scale that the label of an end needs. */
const END_ROOM = 0.12;

/**
 * Round numbers on a scale: 1, 2 and 5 times powers of ten, as many as fit.
 * @param {Pick<Scale, "low" | "high" | "logarithmic">} scale
 * @returns {Tick[]}
 */
export function ticks({ low, high, logarithmic }) {
    if (!(high > low) || (logarithmic && !(low > 0))) return [];
    /** @type {(value: number) => Tick} */
    const tick = (value) => ({
        at: logarithmic ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low),
        text: number(value),
    });
    const round = (logarithmic ? decades(low, high) : steps(low, high)).map(tick);
    // The ends are what one asks first; a round number that is too near to one gives way to it.
    const inner = round.filter(({ at }) => at > END_ROOM && at < 1 - END_ROOM);
    return [{ ...tick(low), at: 0 }, ...inner, { ...tick(high), at: 1 }];
}

/** @param {number} low @param {number} high */
function steps(low, high) {
    const raw = (high - low) / (MOST_TICKS - 1);
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = power * /** @type {number} */ ([1, 2, 5, 10].find((factor) => factor * power >= raw * 0.999));
    const first = Math.ceil(low / step - 1e-9);
    const last = Math.floor(high / step + 1e-9);
    return Array.from({ length: last - first + 1 }, (_, i) => Number(((first + i) * step).toPrecision(12)));
}

/** @param {number} low @param {number} high */
function decades(low, high) {
    const [from, to] = [Math.floor(Math.log10(low)), Math.ceil(Math.log10(high))];
    for (const factors of [[1, 2, 5], [1, 3], [1]]) {
        for (let every = 1; every <= to - from + 1; every++) {
            if (factors.length > 1 && every > 1) break;
            const found = [];
            for (let power = from; power <= to; power += every) {
                for (const factor of factors) found.push(Number(`${factor}e${power}`));
            }
            const inside = found.filter((value) => value >= low * 0.999 && value <= high * 1.001);
            if (inside.length <= MOST_TICKS && inside.length >= 2) return inside;
        }
    }
    // Less than any two round numbers apart: then it is as good as linear.
    return steps(low, high);
}

/** Shows a scale beside the picture; null takes it away. @param {Scale | null} scale */
export function showLegend(scale) {
    const figure = element("legend");
    figure.hidden = scale === null;
    if (scale === null) return;
    const words = title(scale);
    element("legend-title").textContent = words;
    element("legend-text").textContent =
        `From ${number(scale.low)} to ${number(scale.high)} ${scale.unit}, ${scale.logarithmic ? "logarithmic" : "linear"}`;
    paintBar(/** @type {HTMLCanvasElement} */ (element("legend-bar")), scale.colours);
    element("legend-ticks").replaceChildren(
        ...ticks(scale).map(({ at, text }) => {
            const tick = document.createElement("span");
            tick.textContent = text;
            tick.style.left = `${100 * at}%`;
            return tick;
        }),
    );
}

/** @param {Scale} scale */
const title = ({ unit }) => `${unit === "lx" ? "Illuminance" : "Irradiance"}, ${unit}`;

/** @param {HTMLCanvasElement} canvas of 256 by 1 pixels @param {Uint8Array} colours */
function paintBar(canvas, colours) {
    const context = canvas.getContext("2d");
    context?.putImageData(new ImageData(new Uint8ClampedArray(colours), 256, 1), 0, 0);
}

/**
 * Draws the legend into a picture's lower left corner: false colours without it say nothing.
 * @param {CanvasRenderingContext2D} context
 * @param {number} height of the picture
 * @param {Scale} scale
 * @param {number} pixel how many of the picture's pixels make one of the screen
 */
export function drawLegend(context, height, scale, pixel) {
    const [width, tall, edge] = [340 * pixel, 80 * pixel, 12 * pixel];
    context.save();
    context.translate(edge, height - tall - edge);
    context.fillStyle = "rgb(20 23 26 / 88%)";
    context.beginPath();
    context.roundRect(0, 0, width, tall, 8 * pixel);
    context.fill();

    const [left, inner] = [20 * pixel, width - 40 * pixel];
    const bar = document.createElement("canvas");
    [bar.width, bar.height] = [256, 1];
    paintBar(bar, scale.colours);
    context.drawImage(bar, left, 32 * pixel, inner, 14 * pixel);

    context.fillStyle = "#eceff1";
    context.font = `600 ${14 * pixel}px system-ui, sans-serif`;
    context.fillText(title(scale), left, 22 * pixel);
    context.font = `${12 * pixel}px system-ui, sans-serif`;
    context.textAlign = "center";
    for (const { at, text } of ticks(scale)) {
        context.fillRect(left + at * inner - pixel / 2, 46 * pixel, pixel, 5 * pixel);
        context.fillText(text, left + at * inner, 65 * pixel);
    }
    context.restore();
}
