/**
 * The order of see-through triangles from the farthest to the nearest, exact for every place of the eye: a tree of planes
 * (Fuchs, Kedem and Naylor, "On visible surface generation by a priori tree structures", 1980), made once, since nothing moves
 * but the eye. What a plane cuts becomes two pieces. Where a tree would cost too much, the rest is ordered by its middles.
 */

import { along, cross, dot, length, mix, normalize, scale, sub } from "twinray/vec.js";

/** @import { Vec3 } from "twinray/types.js" */

/**
 * A corner of a piece, and where on its triangle it lies.
 * @typedef {{ point: Vec3, place: [number, number] }} Corner
 * @typedef {{ triangle: number, corners: Corner[] }} Piece convex, wound as its triangle
 * @typedef {{ normal: Vec3, offset: number }} Plane
 * @typedef {{ plane: Plane, within: Piece[], front: Tree, behind: Tree }} Branch
 * @typedef {Branch | { loose: Piece[] } | null} Tree
 */

/** Corners so near to a plane, in radii of the scene, lie in it: what single precision makes of places. */
const THICKNESS = 4e-6;
/** Comparisons of a piece with a plane at most, so that a scene of much glass opens as fast as others. */
const MOST_COMPARISONS = 3e6;
/** Planes between the root and a leaf at most: a round body's faces are all on one side of each other. */
const MOST_PLANES = 400;
/** Pieces over triangles, at most, and how many are few. */
const MOST_PIECES = 3;
const FEW_PIECES = 20_000;
/** Triangles whose planes are tried for a branch. */
const TRIED = 6;
/** More pieces than these are first divided across axes. */
const MANY = 48;

export class Painter {
    #tree;
    #comparisons = 0;
    #pieces;
    #most;

    /**
     * @param {Piece[]} triangles
     * @param {number} radius of the scene
     */
    constructor(triangles, radius) {
        this.thickness = THICKNESS * radius;
        this.#pieces = triangles.length;
        this.#most = Math.max(FEW_PIECES, MOST_PIECES * triangles.length);
        this.#tree = this.#grow(triangles, 0);
    }

    /**
     * Pieces from the farthest to the nearest, in groups; those of a group lie in one plane, or are a single piece.
     * @param {Vec3} eye
     * @returns {Piece[][]}
     */
    order(eye) {
        /** @type {Piece[][]} */
        const groups = [];
        const walk = (/** @type {Tree} */ tree) => {
            if (!tree) return;
            if ("loose" in tree) {
                const far = tree.loose.map((piece) => length(sub(middle(piece), eye)));
                const numbers = tree.loose.map((_, k) => k).sort((a, b) => far[b] - far[a]);
                for (const k of numbers) groups.push([tree.loose[k]]);
                return;
            }
            const isInFront = dot(tree.plane.normal, eye) > tree.plane.offset;
            walk(isInFront ? tree.behind : tree.front);
            if (tree.within.length > 0) groups.push(tree.within);
            walk(isInFront ? tree.front : tree.behind);
        };
        walk(this.#tree);
        return groups;
    }

    /**
     * @param {Piece[]} pieces
     * @param {number} depth
     * @returns {Tree}
     */
    #grow(pieces, depth) {
        if (pieces.length === 0) return null;
        const isTooMuch = this.#comparisons > MOST_COMPARISONS || this.#pieces > this.#most || depth > MOST_PLANES;
        const plane = isTooMuch ? null : this.#plane(pieces);
        if (!plane) return { loose: pieces };
        /** @type {{ within: Piece[], front: Piece[], behind: Piece[] }} */
        const parts = { within: [], front: [], behind: [] };
        for (const piece of pieces) {
            const { low, high } = this.#extent(piece, plane);
            if (low >= 0 && high <= 0) parts.within.push(piece);
            else if (low >= 0) parts.front.push(piece);
            else if (high <= 0) parts.behind.push(piece);
            else {
                parts.front.push(half(piece, plane, 1));
                parts.behind.push(half(piece, plane, -1));
                this.#pieces += 1;
            }
        }
        const front = this.#grow(parts.front, depth + 1);
        return { plane, within: parts.within, front, behind: this.#grow(parts.behind, depth + 1) };
    }

    /**
     * The plane that cuts few and divides evenly; null if there is none.
     * @param {Piece[]} pieces
     * @returns {Plane | null}
     */
    #plane(pieces) {
        const step = Math.max(1, Math.floor(pieces.length / TRIED));
        /** @type {(Plane | null)[]} */
        const planes = [];
        for (let k = 0; k < pieces.length; k += step) planes.push(planeOf(pieces[k]));
        if (pieces.length > MANY) planes.push(...across(pieces));
        let [best, least] = [/** @type {Plane | null} */ (null), Infinity];
        for (const plane of planes) {
            if (!plane) continue;
            let [cut, front, behind, within] = [0, 0, 0, 0];
            for (const piece of pieces) {
                const { low, high } = this.#extent(piece, plane);
                if (low >= 0 && high <= 0) within += 1;
                else if (low >= 0) front += 1;
                else if (high <= 0) behind += 1;
                else cut += 1;
            }
            // A branch has to leave less to its own branches than it got.
            if (Math.max(front, behind) + cut >= pieces.length && within === 0) continue;
            const cost = 8 * cut + Math.abs(front - behind);
            if (cost < least) [best, least] = [plane, cost];
        }
        return best;
    }

    /**
     * Between which distances from a plane a piece lies; 0 for as good as in it.
     * @param {Piece} piece
     * @param {Plane} plane
     */
    #extent({ corners }, plane) {
        this.#comparisons += 1;
        let [low, high] = [0, 0];
        for (const { point } of corners) {
            const d = dot(plane.normal, point) - plane.offset;
            if (d < -this.thickness) low = Math.min(low, d);
            if (d > this.thickness) high = Math.max(high, d);
        }
        return { low, high };
    }
}

/** @param {Piece} piece @returns {Plane | null} */
function planeOf({ corners }) {
    // Of pieces that were cut off, one corner may lie between its neighbours: the sum over all is what has a direction.
    const [first, ...others] = corners.map((c) => c.point);
    /** @type {Vec3} */
    let sum = [0, 0, 0];
    for (let k = 1; k < others.length; k++) {
        sum = along(sum, cross(sub(others[k - 1], first), sub(others[k], first)), 1);
    }
    const normal = normalize(sum);
    // A sliver has no plane.
    return length(sum) > 0 ? { normal, offset: dot(normal, middle({ triangle: 0, corners })) } : null;
}

/**
 * Planes across the axes, through the middle one of the pieces.
 * @param {Piece[]} pieces
 * @returns {Plane[]}
 */
function across(pieces) {
    const middles = pieces.map(middle);
    return [0, 1, 2].map((axis) => {
        const sorted = middles.map((p) => p[axis]).sort((a, b) => a - b);
        const normal = /** @type {Vec3} */ ([0, 1, 2].map((k) => (k === axis ? 1 : 0)));
        return { normal, offset: sorted[sorted.length >> 1] };
    });
}

/** @param {Piece} piece @returns {Vec3} */
function middle({ corners }) {
    /** @type {Vec3} */
    const sum = corners.reduce((a, c) => along(a, c.point, 1), /** @type {Vec3} */ ([0, 0, 0]));
    return scale(sum, 1 / corners.length);
}

/**
 * What of a piece lies in front of a plane, or behind it.
 * @param {Piece} piece
 * @param {Plane} plane
 * @param {1 | -1} side
 * @returns {Piece}
 */
function half({ triangle, corners }, { normal, offset }, side) {
    /** @type {Corner[]} */
    const kept = [];
    const distances = corners.map(({ point }) => side * (dot(normal, point) - offset));
    corners.forEach((corner, k) => {
        const next = (k + 1) % corners.length;
        if (distances[k] >= 0) kept.push(corner);
        if (distances[k] >= 0 !== distances[next] >= 0) {
            kept.push(crossing(corner, corners[next], distances[k] / (distances[k] - distances[next])));
        }
    });
    return { triangle, corners: kept };
}

/**
 * The corner where an edge goes through a plane.
 * @param {Corner} a
 * @param {Corner} b
 * @param {number} t
 * @returns {Corner}
 */
function crossing(a, b, t) {
    const place = /** @type {[number, number]} */ ([0, 1].map((k) => a.place[k] + (b.place[k] - a.place[k]) * t));
    return { point: mix(a.point, b.point, t), place };
}
