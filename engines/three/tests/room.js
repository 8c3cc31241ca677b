/** A room whose walls have vertices enough to carry its light: a cube from -1 to 1, open to +z, under a lamp. */

/** Of the vertices, where they have one. */
export const COLOUR = [0.8, 0.5, 0.5];

/**
 * The text of a glTF file.
 * @param {number} n squares along each side of a wall
 * @param {boolean} hasColours whether its vertices have a colour
 */
export function roomFile(n, hasColours) {
    /** @type {number[]} */
    const positions = [];
    /** @type {number[]} */
    const normals = [];
    /** @type {number[]} */
    const indices = [];
    const quad = (
        /** @type {number} */ n,
        /** @type {number[]} */ corner,
        /** @type {number[]} */ u,
        /** @type {number[]} */ v,
    ) => {
        const first = positions.length / 3;
        const normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
        const length = Math.hypot(...normal);
        for (let j = 0; j <= n; j++) {
            for (let i = 0; i <= n; i++) {
                positions.push(...corner.map((c, k) => c + (u[k] * i) / n + (v[k] * j) / n));
                normals.push(...normal.map((c) => c / length));
            }
        }
        for (let j = 0; j < n; j++) {
            for (let i = 0; i < n; i++) {
                const at = first + j * (n + 1) + i;
                indices.push(at, at + 1, at + n + 2, at, at + n + 2, at + n + 1);
            }
        }
    };
    quad(n, [-1, -1, 1], [2, 0, 0], [0, 0, -2]);
    quad(n, [-1, 1, -1], [2, 0, 0], [0, 0, 2]);
    quad(n, [-1, -1, -1], [2, 0, 0], [0, 2, 0]);
    quad(n, [-1, -1, 1], [0, 0, -2], [0, 2, 0]);
    quad(n, [1, -1, -1], [0, 0, 2], [0, 2, 0]);
    const walls = { vertices: positions.length / 3, indices: indices.length };
    quad(1, [-0.4, 0.6, -0.4], [0.8, 0, 0], [0, 0, 0.8]);
    const colours = Array.from({ length: walls.vertices }, () => COLOUR).flat();
    const bytes = Buffer.concat([
        Buffer.from(new Float32Array(positions).buffer),
        Buffer.from(new Float32Array(normals).buffer),
        Buffer.from(new Float32Array(colours).buffer),
        Buffer.from(new Uint32Array(indices).buffer),
    ]);
    const all = positions.length / 3;
    const views = [12 * all, 12 * all, 12 * walls.vertices, 4 * indices.length];
    const offset = (/** @type {number} */ k) => views.slice(0, k).reduce((a, b) => a + b, 0);
    const floats = (/** @type {number} */ view, /** @type {number} */ first, /** @type {number} */ count) => ({
        bufferView: view,
        byteOffset: 12 * first,
        componentType: 5126,
        count,
        type: "VEC3",
        ...(view === 0 ? { min: [-1, -1, -1], max: [1, 1, 1] } : {}),
    });
    const numbers = (/** @type {number} */ first, /** @type {number} */ count) => ({
        bufferView: 3,
        byteOffset: 4 * first,
        componentType: 5125,
        count,
        type: "SCALAR",
    });
    const lamp = indices.slice(walls.indices).map((k) => k - walls.vertices);
    Buffer.from(new Uint32Array(lamp).buffer).copy(bytes, offset(3) + 4 * walls.indices);
    const grey = { metallicFactor: 0, roughnessFactor: 1, baseColorFactor: [0.7, 0.7, 0.7, 1] };
    return JSON.stringify({
        asset: { version: "2.0" },
        scene: 0,
        scenes: [{ nodes: [0, 1, 2] }],
        nodes: [
            { mesh: 0, name: "room" },
            { mesh: 1, name: "lamp" },
            { camera: 0, translation: [0, 0, 3.2] },
        ],
        cameras: [{ type: "perspective", perspective: { yfov: 0.9, znear: 0.1 } }],
        materials: [
            // Nothing but diffuse: three.js shows no reflection of light that is baked.
            {
                name: "grey",
                pbrMetallicRoughness: grey,
                extensions: { KHR_materials_specular: { specularFactor: 0 } },
            },
            {
                name: "lamp",
                emissiveFactor: [1, 1, 1],
                extensions: { KHR_materials_emissive_strength: { emissiveStrength: 20 } },
                pbrMetallicRoughness: { ...grey, baseColorFactor: [0, 0, 0, 1] },
            },
        ],
        extensionsUsed: ["KHR_materials_emissive_strength", "KHR_materials_specular"],
        meshes: [
            {
                primitives: [
                    {
                        attributes: { POSITION: 0, NORMAL: 1, ...(hasColours ? { COLOR_0: 2 } : {}) },
                        indices: 3,
                        material: 0,
                    },
                ],
            },
            { primitives: [{ attributes: { POSITION: 4, NORMAL: 5 }, indices: 6, material: 1 }] },
        ],
        accessors: [
            floats(0, 0, walls.vertices),
            floats(1, 0, walls.vertices),
            floats(2, 0, walls.vertices),
            numbers(0, walls.indices),
            floats(0, walls.vertices, 4),
            floats(1, walls.vertices, 4),
            numbers(walls.indices, 6),
        ],
        bufferViews: views.map((byteLength, k) => ({ buffer: 0, byteOffset: offset(k), byteLength })),
        buffers: [
            { byteLength: bytes.length, uri: `data:application/octet-stream;base64,${bytes.toString("base64")}` },
        ],
    });
}
