/**
 * Panes between two glowing walls, as a glTF file, and what is seen through them: nothing in it scatters light, so that every
 * pixel is known without a solver. In the file they stand in an order that is wrong from either side.
 */

/** @import { Vec3 } from "twinray/types.js" */

/** Radiance of the walls, behind the panes for the camera in front and for the one behind. @type {Record<string, Vec3>} */
const WALLS = { front: [0.9, 0.8, 0.6], back: [0.3, 0.6, 0.9] };
/** Coloured glass in the middle: what passes of each colour. @type {Vec3} */
const GLASS = [0.9, 0.5, 0.2];
/** Blended panes before and behind it, which glow towards the glass. */
const ALPHA = 0.5;
/** @type {Record<string, Vec3>} */
const GLOW = { front: [0.1, 0.9, 0.2], back: [0.8, 0.1, 0.5] };

/**
 * Radiance in the middle of the picture, through three panes: the nearest is seen from behind, where it is black.
 * @param {string} camera
 */
export const throughPanes = (camera) =>
    GLASS.map((t, k) => (1 - ALPHA) * t * (ALPHA * GLOW[camera][k] + (1 - ALPHA) * WALLS[camera][k]));

/** Radiance of the wall alone. @param {string} camera */
export const wall = (camera) => WALLS[camera];

export function panesFile() {
    /** @type {number[]} */
    const numbers = [];
    /** @type {any[]} */
    const [accessors, meshes, nodes, materials] = [[], [], [], []];
    /** @type {(name: string, size: number, z: number, facing: 1 | -1, material: any) => void} */
    const square = (name, size, z, facing, material) => {
        const corners = [
            [-1, -1],
            [1, -1],
            [1, 1],
            [-1, -1],
            [1, 1],
            [-1, 1],
        ];
        const points = corners.map(([x, y]) => [x * facing * size, y * size, z]);
        const [min, max] = [Math.min, Math.max].map((f) => [0, 1, 2].map((k) => f(...points.map((p) => p[k]))));
        const byteOffset = 4 * numbers.length;
        numbers.push(...points.flat());
        accessors.push({ bufferView: 0, byteOffset, componentType: 5126, count: 6, type: "VEC3", min, max });
        meshes.push({ primitives: [{ attributes: { POSITION: accessors.length - 1 }, material: materials.length }] });
        nodes.push({ name, mesh: meshes.length - 1 });
        materials.push({ name, ...material });
    };
    /** Lambertian, so that nothing is mirrored. */
    const matt = { KHR_materials_specular: { specularFactor: 0 } };
    const looks = (/** @type {number[]} */ baseColorFactor) => ({
        pbrMetallicRoughness: { baseColorFactor, metallicFactor: 0, roughnessFactor: 0 },
    });
    const glowing = (/** @type {Vec3} */ emissiveFactor) => ({
        ...{ ...looks([0, 0, 0, ALPHA]), emissiveFactor, extensions: matt, doubleSided: true, alphaMode: "BLEND" },
    });
    const wall = (/** @type {Vec3} */ emissiveFactor) => ({ ...looks([0, 0, 0, 1]), emissiveFactor, extensions: matt });
    const passing = { ...matt, KHR_materials_transmission: { transmissionFactor: 1 } };
    square("glass", 1, 0, 1, { ...looks([...GLASS, 1]), extensions: passing, doubleSided: true });
    square("far pane", 1, -0.5, 1, glowing(GLOW.front));
    square("near pane", 1, 0.5, -1, glowing(GLOW.back));
    square("far wall", 6, -3, 1, wall(WALLS.front));
    square("near wall", 6, 3, -1, wall(WALLS.back));
    nodes.push({ name: "front", camera: 0, translation: [0, 0, 2.5] });
    nodes.push({ name: "back", camera: 0, translation: [0, 0, -2.5], rotation: [0, 1, 0, 0] });
    nodes.push({ name: "plan", camera: 1, translation: [0, 0, 2] });
    const bytes = Buffer.from(new Float32Array(numbers).buffer);
    return JSON.stringify({
        asset: { version: "2.0" },
        extensionsUsed: ["KHR_materials_specular", "KHR_materials_transmission"],
        buffers: [
            { byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString("base64")}` },
        ],
        bufferViews: [{ buffer: 0, byteLength: bytes.length }],
        ...{ accessors, meshes, nodes, materials },
        cameras: [
            { type: "perspective", perspective: { yfov: 1, znear: 0.01 } },
            { type: "orthographic", orthographic: { xmag: 1, ymag: 1, znear: 0.01, zfar: 9 } },
        ],
        scenes: [{ nodes: [...nodes.keys()] }],
        scene: 0,
    });
}
