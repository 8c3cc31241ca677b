// What is known at a place of a triangle: the shader's look-ups once more, for a single point.

/** @import { Vec3, Walk } from "twinray/types.js" */
/** @import { Resources } from "twinray/resources.js" */

/**
 * @typedef {object} Place
 * @property {Vec3} point
 * @property {Vec3} normal of the triangle, on the side that is seen
 * @property {number} material
 * @property {number} cell within the triangle's side
 * @property {{slot: number, weight: number}[]} around
 */

/** Luminance of linear Rec. 709. @param {number[]} c */
const luminance = (c) => 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];

/**
 * @param {Walk} walk
 * @param {Resources} resources
 * @param {number} triangle
 * @param {number} u
 * @param {number} v
 * @param {boolean} front
 * @returns {Place}
 */
export function find(walk, resources, triangle, u, v, front) {
    const { positions, corners } = walk.scene.arrays;
    const [a, b, c] = [0, 1, 2].map((k) => {
        const vertex = corners[3 * triangle + k];
        return [0, 1, 2].map((i) => positions[3 * vertex + i]);
    });
    const [p, q] = [b, c].map((x) => x.map((y, k) => y - a[k]));
    const point = /** @type {Vec3} */ (a.map((x, k) => x + u * p[k] + v * q[k]));
    const across = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    const size = (front ? 1 : -1) * Math.hypot(...across);
    const record = resources.records.subarray(8 * triangle, 8 * triangle + 8);
    const first = front ? record[1] : record[2];
    const { around, cell } = locate(record, u, v);
    return {
        point,
        normal: /** @type {Vec3} */ (across.map((x) => x / size)),
        material: record[3],
        cell,
        around: around.map(([slot, weight]) => ({ slot: first + slot, weight })),
    };
}

/**
 * Slots around a place with their weights, and the cell there: slotsAround and cellAt of shaders.js.
 * @param {Uint32Array} record
 * @param {number} u
 * @param {number} v
 * @returns {{around: number[][], cell: number}}
 */
function locate(record, u, v) {
    if (record[0] >>> 31) {
        const foot = ((record[0] >>> 2) & 0xffff) / 65535;
        const [columns, rows] = [record[6], record[7]];
        const w = [1 - u - v, u, v];
        const first = record[0] & 3;
        const [b, c] = [w[(first + 1) % 3], w[(first + 2) % 3]];
        const x = Math.min(1, Math.max(0, b + c * foot));
        const rising = x < foot || foot === 1;
        const height = Math.min(1, Math.max(0, rising ? x / Math.max(foot, 1e-9) : (1 - x) / (1 - foot)));
        const t = height > 0 ? Math.min(1, Math.max(0, c / height)) : 0;
        const [i, j] = [Math.min(columns - 1, Math.floor(x * columns)), Math.min(rows - 1, Math.floor(t * rows))];
        const [fx, fy] = [x * columns - i, t * rows - j];
        const slot = i * (rows + 1) + j;
        const left = x < foot ? (x * x) / foot : 1 - (1 - x) ** 2 / Math.max(1 - foot, 1e-9);
        return {
            around: [
                [slot, (1 - fx) * (1 - fy)],
                [slot + 1, (1 - fx) * fy],
                [slot + rows + 1, fx * (1 - fy)],
                [slot + rows + 2, fx * fy],
            ],
            cell: Math.min(columns - 1, Math.floor(left * columns)) * rows + j,
        };
    }
    const m = record[0];
    const [x, y] = [Math.max(0, u) * m, Math.max(0, v) * m];
    const j = Math.min(m - 1, Math.floor(y));
    const i = Math.min(m - 1 - j, Math.floor(x));
    const [fx, fy] = [x - i, y - j];
    const low = j * (m + 1) - (j * (j - 1)) / 2 + i;
    const high = low + m + 1 - j;
    const upper = fx + fy > 1 && i + j + 1 < m;
    const around = upper
        ? [
              [high + 1, fx + fy - 1],
              [high, 1 - fx],
              [low + 1, 1 - fy],
          ]
        : [
              [low, 1 - fx - fy],
              [low + 1, fx],
              [high, fy],
          ];
    return { around, cell: j * (2 * m - j) + 2 * i + (upper ? 1 : 0) };
}

/** Three numbers with a common exponent. @param {number} bits @param {number} scale */
export function unpack(bits, scale) {
    const unit = 2 ** ((bits >>> 27) - 24) * scale;
    return [bits & 511, (bits >>> 9) & 511, (bits >>> 18) & 511].map((x) => x * unit);
}

/**
 * @param {Resources} resources
 * @param {Place} place
 */
export function irradianceAt({ light, nodes }, { around }) {
    /** @type {Vec3} */
    const irradiance = [0, 0, 0];
    let [error, known] = [0, 0];
    for (const { slot, weight } of around) {
        const node = nodes[slot];
        const e = unpack(light.irradiance[node], light.scale);
        for (let k = 0; k < 3; k++) irradiance[k] += weight * e[k];
        const code = light.error[node];
        // Where no ray has been, nothing is known of the error.
        if (code === 255) continue;
        error += weight * (2 ** (code / 16) / 4096);
        known += weight;
    }
    return { irradiance, illuminance: luminance(irradiance), error: known > 0 ? error / known : NaN };
}

/**
 * Illuminance from the second to the ninety-eighth percentile of nodes.
 * @param {{irradiance: Uint32Array, scale: number}} light
 * @returns {[number, number]}
 */
export function medianRange({ irradiance, scale }) {
    const step = Math.max(1, Math.floor(irradiance.length / 20000));
    /** @type {number[]} */
    const values = [];
    for (let node = 0; node < irradiance.length; node += step) {
        const value = luminance(unpack(irradiance[node], scale));
        if (value > 0) values.push(value);
    }
    if (values.length === 0) return [0, 1];
    values.sort((a, b) => a - b);
    const at = (/** @type {number} */ share) => values[Math.min(values.length - 1, Math.floor(share * values.length))];
    return [at(0.02), Math.max(at(0.98), 1.001 * at(0.02))];
}
