/**
 * The picture as a file, and links to it: what a visitor takes away.
 */

import { toast } from "twinray/announce.js";
import { drawLegend } from "twinray/legend.js";

/** @import { Scale } from "twinray/legend.js" */

/**
 * Saves a picture, with the legend if it is in false colour.
 * @param {Blob} picture PNG, as the renderer has it
 * @param {string} name of the scene
 * @param {Scale | null} scale
 */
export async function savePicture(picture, name, scale) {
    const blob = scale ? await withLegend(picture, scale) : picture;
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

/** @param {Blob} picture @param {Scale} scale @returns {Promise<Blob>} */
async function withLegend(picture, scale) {
    const bitmap = await createImageBitmap(picture);
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
    const context = canvas.getContext("2d");
    if (!context) return picture;
    context.drawImage(bitmap, 0, 0);
    // On a small picture the legend shrinks rather than covers it.
    drawLegend(context, canvas.height, scale, Math.min(devicePixelRatio, canvas.width / 364));
    return new Promise((resolve) => canvas.toBlob((blob) => resolve(blob ?? picture), "image/png"));
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
