// See-through surfaces as the graphics processor draws them: pieces of triangles, from the farthest to the nearest.

import { Painter } from "twinray/painter.js";

/** @import { Walk, Vec3 } from "twinray/types.js" */
/** @import { Batch } from "twinray/resources.js" */
/** @import { Piece } from "twinray/painter.js" */

/**
 * What one draw call takes: indices, their batch, and whether each colour passes by a share of its own.
 * @typedef {{ start: number, count: number, batch: Batch, tinted: boolean }} Run
 */

/** Draw calls at most: what more surfaces let through is drawn as grey, which takes one call for many. */
const MOST_RUNS = 2000;
/** Numbers of a vertex: point, normal, two pairs of texture coordinates, place on the triangle; then the triangle. */
const WIDTH = 13;
/** Where the attributes stand in a vertex, by location: those of the other surfaces, then those that these add. */
const ATTRIBUTES = [
    [0, 3, 0],
    [1, 3, 3],
    [2, 4, 6],
    [3, 2, 10],
];

export class SeeThrough {
    /** @type {Run[]} */
    runs = [];
    /** @type {Map<Piece, number>} */
    #firsts = new Map();
    /** @type {Vec3 | null} */
    #eye = null;

    /**
     * @param {WebGL2RenderingContext} gl
     * @param {Walk} walk
     * @param {Batch[]} batches that are see-through
     */
    constructor(gl, walk, batches) {
        this.gl = gl;
        this.walk = walk;
        this.batches = batches;
        const triangles = batches.flatMap(({ start, count }) => Array.from({ length: count }, (_, k) => start + k));
        this.painter = new Painter(
            triangles.map((t) => whole(walk, t)),
            walk.radius,
        );
        /** @type {number[]} */
        const vertices = [];
        for (const piece of this.painter.order([0, 0, 0]).flat()) {
            this.#firsts.set(piece, vertices.length / WIDTH);
            vertices.push(...vertexNumbers(walk, piece));
        }
        this.vertices = gl.createVertexArray();
        this.indices = gl.createBuffer();
        gl.bindVertexArray(this.vertices);
        gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
        const numbers = new Float32Array(vertices);
        const whose = new Uint32Array(numbers.buffer);
        for (let i = WIDTH - 1; i < whose.length; i += WIDTH) whose[i] = vertices[i];
        gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.STATIC_DRAW);
        for (const [place, width, offset] of ATTRIBUTES) {
            gl.enableVertexAttribArray(place);
            gl.vertexAttribPointer(place, width, gl.FLOAT, false, 4 * WIDTH, 4 * offset);
        }
        gl.enableVertexAttribArray(4);
        gl.vertexAttribIPointer(4, 1, gl.UNSIGNED_INT, 4 * WIDTH, 4 * (WIDTH - 1));
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.indices);
        gl.bindVertexArray(null);
    }

    /**
     * Orders what is drawn for this eye. A turn of the head changes nothing, nor does another frame of the same view.
     * @param {Vec3} eye
     */
    sort(eye) {
        if (this.#eye?.every((x, k) => x === eye[k])) return;
        this.#eye = [...eye];
        const groups = this.painter.order(eye);
        let runs = this.#arranged(groups, true);
        if (runs.length > MOST_RUNS) runs = this.#arranged(groups, false);
        this.runs = runs;
    }

    /**
     * @param {Piece[][]} groups
     * @param {boolean} mayTint
     * @returns {Run[]}
     */
    #arranged(groups, mayTint) {
        /** @type {Run[]} */
        const runs = [];
        /** @type {number[]} */
        const indices = [];
        for (const group of groups) {
            let opened = false;
            for (const piece of group) {
                const batch = /** @type {Batch} */ (
                    this.batches.find((b) => piece.triangle < b.start + b.count && piece.triangle >= b.start)
                );
                const tinted = mayTint && isTinted(this.walk, piece.triangle);
                const last = runs.at(-1);
                // Each colour's share takes two calls, the one for all pieces and then the other: these must not overlap.
                const goesOn = last?.batch === batch && last.tinted === tinted && (opened || !tinted);
                if (!goesOn) runs.push({ start: indices.length, count: 0, batch, tinted });
                opened = true;
                const first = /** @type {number} */ (this.#firsts.get(piece));
                for (let k = 2; k < piece.corners.length; k++) indices.push(first, first + k - 1, first + k);
                runs[runs.length - 1].count = indices.length - runs[runs.length - 1].start;
            }
        }
        const { gl } = this;
        gl.bindVertexArray(this.vertices);
        gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(indices), gl.DYNAMIC_DRAW);
        gl.bindVertexArray(null);
        return runs;
    }
}

/** Whether a triangle lets colours pass by different shares. @param {Walk} walk @param {number} triangle */
function isTinted(walk, triangle) {
    const { header, arrays } = walk.scene;
    const material = header.materials[arrays.triangles[8 * triangle + 3]];
    const [r, g, b] = material.surface.color;
    return material.transmission > 0 && (material.textures.base !== null || r !== g || g !== b);
}

/** @param {Walk} walk @param {number} triangle @returns {Piece} */
function whole({ scene: { arrays } }, triangle) {
    const places = /** @type {[number, number][]} */ ([
        [0, 0],
        [1, 0],
        [0, 1],
    ]);
    const corners = places.map((place, k) => {
        const at = 3 * arrays.corners[3 * triangle + k];
        return { point: /** @type {Vec3} */ ([...arrays.positions.subarray(at, at + 3)]), place };
    });
    return { triangle, corners };
}

/** @param {Walk} walk @param {Piece} piece @returns {number[]} */
function vertexNumbers({ scene: { arrays } }, { triangle, corners }) {
    const own = [0, 1, 2].map((k) => arrays.corners[3 * triangle + k]);
    const normals = own.map((v) => fromOctahedron(arrays.normals[2 * v] / 32767, arrays.normals[2 * v + 1] / 32767));
    const texcoords = own.map((v) =>
        arrays.texcoords ? [...arrays.texcoords.subarray(4 * v, 4 * v + 4)] : [0, 0, 0, 0],
    );
    return corners.flatMap(({ point, place: [u, v] }) => {
        const between = (/** @type {number[][]} */ [a, b, c]) => a.map((x, k) => x + u * (b[k] - x) + v * (c[k] - x));
        return [...point, ...between(normals), ...between(texcoords), u, v, triangle];
    });
}

/** As shaders.js has it. @param {number} x @param {number} y @returns {Vec3} */
function fromOctahedron(x, y) {
    const z = 1 - Math.abs(x) - Math.abs(y);
    const t = Math.max(-z, 0);
    const [p, q] = [x + (x >= 0 ? -t : t), y + (y >= 0 ? -t : t)];
    const size = Math.hypot(p, q, z);
    return [p / size, q / size, z / size];
}
