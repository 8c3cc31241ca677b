/**
 * The picture as a file, and links to it: what a visitor takes away.
 */

import { toast } from "twinray/announce.js";
import { drawLegend } from "twinray/legend.js";

/** @import { Scale } from "twinray/legend.js" */
/** @typedef {{ x: number, y: number, text: string }} Mark at shares of the picture's width and height */

/**
 * Saves a picture, with the legend if it is in false colour, and with readings.
 * @param {Blob} picture PNG, as the renderer has it
 * @param {string} name of the scene
 * @param {Scale | null} scale
 * @param {Mark[]} marks
 */
export async function savePicture(picture, name, scale, marks) {
    const blob = scale || marks.length > 0 ? await annotated(picture, scale, marks) : picture;
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${fileName(name)}.png`;
    link.click();
    // The download has its own hold on the data once it has begun.
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    toast(`Saved as ${link.download}`);
}

/** A scene's name without what file systems refuse. @param {string} name */
export function fileName(name) {
    const plain = name.replace(/[\u0000-\u001f\\/:*?"<>|]+/g, "-").replace(/^[.\s-]+|[.\s-]+$/g, "");
    return plain.slice(0, 100) || "scene";
}

/** @param {Blob} picture @param {Scale | null} scale @param {Mark[]} marks @returns {Promise<Blob>} */
async function annotated(picture, scale, marks) {
    const bitmap = await createImageBitmap(picture);
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
    const context = canvas.getContext("2d");
    if (!context) return picture;
    context.drawImage(bitmap, 0, 0);
    // On a small picture the legend shrinks rather than covers it.
    const pixel = Math.min(devicePixelRatio, canvas.width / 364);
    for (const mark of marks) drawMark(context, mark, pixel);
    if (scale) drawLegend(context, canvas.height, scale, pixel);
    return new Promise((resolve) => canvas.toBlob((blob) => resolve(blob ?? picture), "image/png"));
}

/** @param {CanvasRenderingContext2D} context @param {Mark} mark @param {number} pixel */
function drawMark(context, { x, y, text }, pixel) {
    context.save();
    context.translate(x * context.canvas.width, y * context.canvas.height);
    context.scale(pixel, pixel);
    for (const [style, width] of /** @type {[string, number][]} */ ([
        ["rgb(0 0 0 / 70%)", 4],
        ["#fff", 2],
    ])) {
        context.beginPath();
        context.arc(0, 0, 6, 0, 2 * Math.PI);
        context.strokeStyle = style;
        context.lineWidth = width;
        context.stroke();
    }
    context.font = "600 13px system-ui, sans-serif";
    const width = context.measureText(text).width + 12;
    const left = x * context.canvas.width + (13 + width) * pixel > context.canvas.width ? -13 - width : 13;
    context.fillStyle = "rgb(0 0 0 / 75%)";
    context.fillRect(left, -10, width, 20);
    context.fillStyle = "#fff";
    context.fillText(text, left + 6, 5);
    context.restore();
}

/** @param {string} text @param {string} says what to say when it is done */
export async function copy(text, says) {
    try {
        await navigator.clipboard.writeText(text);
        toast(says);
    } catch {
        // No clipboard in a page from a plain file or address; what can be seen can still be copied by hand.
        window.prompt("Copy this:", text);
    }
}
