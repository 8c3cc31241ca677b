// From poses to matrices.

/** @import { Pose, Walk } from "twinray/types.js" */

/** The near plane over the scene's radius. */
const NEAR = 0.0015;

/** @param {number[]} a @param {number[]} b */
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
/** @param {number[]} a @param {number[]} b */
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
/** @param {number[]} a */
const unit = (a) => a.map((x) => x / Math.hypot(...a));

/**
 * @param {Pose} view
 * @param {number} aspect width over height
 * @param {Walk} walk
 * @param {number[]} shift of the film in its own coordinates, [-1, 1]
 * @param {number[]} zoom of the film after the shift
 * @returns {{viewProjection: Float32Array, ray: Float32Array}} column by column; `ray` takes (x, y, 1) of the film to a direction
 */
export function matrices(view, aspect, walk, shift, zoom) {
    const forward = unit(view.forward);
    const right = unit(cross(forward, view.up));
    const up = cross(right, forward);
    const tangent = Math.tan(0.5 * view.fov);
    const [fx, fy] = [1 / (tangent * aspect), 1 / tangent];
    const near = NEAR * walk.radius;
    const far = Math.hypot(...view.eye) + 1.01 * walk.radius + near;
    const rows = [
        scaled(row(right, fx, view.eye), row(forward, shift[0], view.eye), zoom[0]),
        scaled(row(up, fy, view.eye), row(forward, shift[1], view.eye), zoom[1]),
        row(forward, (far + near) / (far - near), view.eye),
        row(forward, 1, view.eye),
    ];
    rows[2][3] -= (2 * far * near) / (far - near);
    const viewProjection = new Float32Array(16);
    for (let c = 0; c < 4; c++) for (let r = 0; r < 4; r++) viewProjection[4 * c + r] = rows[r][c];
    const ray = new Float32Array([
        ...right.map((x) => x / fx),
        ...up.map((x) => x / fy),
        ...forward.map((x, k) => x - (shift[0] * right[k]) / fx - (shift[1] * up[k]) / fy),
    ]);
    return { viewProjection, ray };
}

/** @param {number[]} axis @param {number} factor @param {number[]} eye */
function row(axis, factor, eye) {
    return [...axis.map((x) => factor * x), -factor * dot(axis, eye)];
}

/** @param {number[]} a @param {number[]} b @param {number} zoom */
function scaled(a, b, zoom) {
    return a.map((x, k) => zoom * (x + b[k]));
}
