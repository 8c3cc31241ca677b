/**
 * Vectors of three numbers, as plain arrays: what cameras and controls need of them and no more.
 */

/** @import { Vec3 } from "twinray/types.js" */

/** @type {(a: Vec3, b: Vec3) => Vec3} */
export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];

/** @type {(a: Vec3, b: Vec3) => Vec3} */
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];

/** @type {(a: Vec3, s: number) => Vec3} */
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];

/** `a + b·s`. @type {(a: Vec3, b: Vec3, s: number) => Vec3} */
export const along = (a, b, s) => [a[0] + b[0] * s, a[1] + b[1] * s, a[2] + b[2] * s];

/** @type {(a: Vec3, b: Vec3) => number} */
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** @type {(a: Vec3, b: Vec3) => Vec3} */
export const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

/** @type {(a: Vec3) => number} */
export const length = (a) => Math.hypot(a[0], a[1], a[2]);

/** A vector of length 1; one without a length stays as it is. @type {(a: Vec3) => Vec3} */
export const normalize = (a) => scale(a, 1 / (length(a) || 1));

/** @type {(a: Vec3, b: Vec3, t: number) => Vec3} */
export const mix = (a, b, t) => along(a, sub(b, a), t);
