/**
 * The order of see-through triangles, against rays that meet them.
 */

import assert from "node:assert/strict";
import { test } from "node:test";

import { Painter } from "twinray/painter.js";
import { along, cross, dot, length, sub } from "twinray/vec.js";

/** @import { Vec3 } from "twinray/types.js" */
/** @import { Piece } from "twinray/painter.js" */

/** Numbers from -1 to 1 that are the same in every run. @param {number} seed */
function numbers(seed) {
    let state = seed >>> 0;
    return () => {
        state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
        return state / 2 ** 31 - 1;
    };
}

/** @param {() => number} next @returns {Vec3} */
const anywhere = (next) => [next(), next(), next()];

/** @param {Vec3[]} points @param {number} triangle @returns {Piece} */
const piece = (points, triangle) => ({
    triangle,
    corners: points.map((point, k) => ({ point, place: [k === 1 ? 1 : 0, k === 2 ? 1 : 0] })),
});

/** Where a ray meets a convex piece well within it, or null. @param {Piece} piece @param {Vec3} eye @param {Vec3} way */
function met({ corners }, eye, way) {
    const points = corners.map((c) => c.point);
    /** @type {Vec3} */
    let normal = [0, 0, 0];
    for (let k = 2; k < points.length; k++) {
        normal = along(normal, cross(sub(points[k - 1], points[0]), sub(points[k], points[0])), 1);
    }
    const t = dot(sub(points[0], eye), normal) / dot(way, normal);
    if (!(t > 0)) return null;
    const hit = along(eye, way, t);
    const within = points.every((p, k) => {
        const edge = sub(points[(k + 1) % points.length], p);
        return dot(cross(edge, sub(hit, p)), normal) > 1e-6 * length(edge) * length(normal);
    });
    return within ? t : null;
}

/** Area of a convex piece. @param {Piece} piece */
function area({ corners: [first, ...others] }) {
    let sum = 0;
    for (let k = 1; k < others.length; k++) {
        sum += length(cross(sub(others[k - 1].point, first.point), sub(others[k].point, first.point))) / 2;
    }
    return sum;
}

/** How many pairs along rays come in the wrong order, of how many. @param {Piece[]} triangles @param {() => number} next */
function wrong(triangles, next) {
    const painter = new Painter(triangles, 2);
    let [faults, pairs] = [0, 0];
    for (let view = 0; view < 20; view++) {
        const eye = anywhere(next);
        const pieces = painter.order(eye).flat();
        for (let ray = 0; ray < 100; ray++) {
            const way = anywhere(next);
            const depths = pieces.map((p) => met(p, eye, way)).filter((t) => t !== null);
            for (let k = 1; k < depths.length; k++) {
                pairs += 1;
                if (depths[k] > depths[k - 1] + 1e-5) faults += 1;
            }
        }
    }
    return { faults, pairs };
}

test("triangles that pass through each other are met from the farthest to the nearest, from everywhere", () => {
    const next = numbers(5);
    const triangles = Array.from({ length: 40 }, (_, k) =>
        piece(
            [0, 1, 2].map(() => anywhere(next)),
            k,
        ),
    );
    const { faults, pairs } = wrong(triangles, next);
    assert.ok(pairs > 2000, `only ${pairs} pairs`);
    assert.equal(faults, 0);
});

test("a small pane near the eye comes after a large one whose middle is nearer", () => {
    const large = piece(
        [
            [-9, -1, 0],
            [9, -1, 0],
            [9, 1, 0],
        ],
        0,
    );
    const small = piece(
        [
            [8, -0.9, 0.1],
            [8.2, -0.9, 0.1],
            [8.2, -0.7, 0.1],
        ],
        1,
    );
    const painter = new Painter([small, large], 9);
    const order = (/** @type {Vec3} */ eye) => painter.order(eye).map(([p]) => p.triangle);
    assert.deepEqual(order([3, 0, 3]), [0, 1]);
    assert.deepEqual(order([3, 0, -3]), [1, 0]);
});

test("pieces make up their triangles, and the faces of a pane are one group", () => {
    const next = numbers(9);
    const triangles = Array.from({ length: 60 }, (_, k) =>
        piece(
            [0, 1, 2].map(() => anywhere(next)),
            k,
        ),
    );
    const areas = triangles.map(area);
    for (const p of new Painter(triangles, 2).order([0, 0, 0]).flat()) areas[p.triangle] -= area(p);
    assert.ok(areas.every((a) => Math.abs(a) < 1e-9));
    const [a, b, c, d] = /** @type {Vec3[]} */ ([
        [0, 0, 0],
        [1, 0, 0],
        [1, 1, 0],
        [0, 1, 0],
    ]);
    assert.equal(new Painter([piece([a, b, c], 0), piece([a, c, d], 1)], 1).order([0, 0, 1]).length, 1);
});

test("much glass costs a bounded time, and nothing of it is lost; slivers are no matter", () => {
    const next = numbers(3);
    const at = (/** @type {number} */ i, /** @type {number} */ j) => {
        const [u, v] = [(Math.PI * i) / 100, (2 * Math.PI * j) / 100];
        return /** @type {Vec3} */ ([Math.sin(u) * Math.cos(v), Math.cos(u), Math.sin(u) * Math.sin(v)]);
    };
    /** @type {Piece[]} */
    const triangles = [];
    for (let i = 0; i < 100; i++) {
        for (let j = 0; j < 100; j++) {
            triangles.push(piece([at(i, j), at(i + 1, j), at(i + 1, j + 1)], triangles.length));
            triangles.push(piece([at(i, j), at(i + 1, j + 1), at(i, j + 1)], triangles.length));
        }
    }
    for (let k = 0; k < 50; k++) {
        const point = anywhere(next);
        triangles.push(piece([point, point, point], triangles.length));
    }
    const pieces = new Painter(triangles, 1).order([3, 0, 0]).flat();
    assert.equal(new Set(pieces.map((p) => p.triangle)).size, triangles.length);
    assert.ok(pieces.length < 4 * triangles.length);
});
