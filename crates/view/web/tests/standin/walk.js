/**
 * A scene for tests of the page's controls: a room with three boxes, as plain data. It stands in for the decoder of packages.
 */

/** @import { Vec3, Walk } from "twinray/types.js" */

const DEGREES = Math.PI / 180;

/** Axis-parallel boxes, the first one seen from within. @type {{ low: Vec3, high: Vec3, material: string, colour: Vec3 }[]} */
export const BOXES = [
    { low: [-4, -1.5, -3], high: [4, 1.5, 3], material: "plaster, white", colour: [0.75, 0.72, 0.66] },
    { low: [-1.6, -1.5, -1.8], high: [-0.2, -0.4, -0.6], material: "oak, oiled", colour: [0.45, 0.3, 0.17] },
    { low: [0.8, -1.5, -2.2], high: [1.9, 0.5, -1.2], material: "steel, painted blue", colour: [0.2, 0.3, 0.55] },
    { low: [2.2, -1.5, 0.6], high: [3.2, -0.9, 1.8], material: "fabric, red", colour: [0.6, 0.15, 0.12] },
];

/** @returns {Promise<Walk>} */
export async function loadWalk() {
    const query = new URLSearchParams(location.search);
    if (query.has("fail")) throw new Error("The scene could not be loaded: the server does not answer.");
    const embedded = document.getElementById("walk") !== null;
    return {
        name: query.get("name") ?? "reading room",
        up: [0, 1, 0],
        centre: [10, 1.5, -20],
        radius: 5.2,
        bounds: [
            [-4, -1.5, -3],
            [4, 1.5, 3],
        ],
        cameras: [
            { name: "entrance", eye: [0, 0.1, 2.8], forward: [0, 0, -1], up: [0, 1, 0], fov: 60 * DEGREES },
            {
                name: "window",
                eye: [-3.6, 0.6, 2.4],
                forward: norm([0.8, -0.25, -0.6]),
                up: [0, 1, 0],
                fov: 50 * DEGREES,
            },
            { name: "plan", eye: [0, 1.4, 0], forward: [0, -1, 0], up: [0, 0, -1], fov: 90 * DEGREES },
        ],
        home: 0,
        unit: query.has("watt") ? { name: "W/m²", factor: 1 } : { name: "lx", factor: 179 },
        live: !embedded && !query.has("still"),
        base: ".",
        materials: BOXES.map(({ material }) => ({ name: material })),
        stats: { triangles: 48_120, cells: 78_443, rays: 5_000_000, error: 0.021 },
        generator: "twinray, stand-in of the tests",
    };
}

/** @param {Vec3} v @returns {Vec3} */
function norm(v) {
    const length = Math.hypot(...v);
    return [v[0] / length, v[1] / length, v[2] / length];
}
