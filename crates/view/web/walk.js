// The package of a scene, and containers of light: bytes to typed arrays. See crates/view/src/container.rs.

/** @import { Container, Pose, Vec3, Walk } from "twinray/types.js" */

const MAGIC = "twinwalk";
const TYPES = {
    u8: Uint8Array,
    i8: Int8Array,
    i16: Int16Array,
    u16: Uint16Array,
    u32: Uint32Array,
    f32: Float32Array,
};

/**
 * Reads a container; arrays are views into the buffer.
 * @param {ArrayBuffer} buffer
 * @returns {Container}
 */
export function readContainer(buffer) {
    const bytes = new Uint8Array(buffer);
    const magic = String.fromCharCode(...bytes.subarray(0, 8));
    if (magic !== MAGIC) throw new Error("these bytes are no walk-through");
    const length = new DataView(buffer).getUint32(8, true);
    const header = JSON.parse(new TextDecoder().decode(bytes.subarray(16, 16 + length)));
    /** @type {Container["arrays"]} */
    const arrays = {};
    for (const [name, place] of Object.entries(header.arrays)) {
        const { type, offset, length: count } = /** @type {any} */ (place);
        const Type = TYPES[/** @type {keyof typeof TYPES} */ (type)];
        arrays[name] = new Type(buffer, 16 + length + offset, count);
    }
    return { header, arrays };
}

/**
 * The walk of this page: of the data in it, or of the server that it came from.
 * @returns {Promise<Walk>}
 */
export async function loadWalk() {
    const embedded = document.getElementById("walk-scene");
    const scene = embedded ? await unpacked(embedded) : await fetched("scene");
    const light = embedded ? await unpacked(document.getElementById("walk-light")) : null;
    return describe(scene, light);
}

/**
 * @param {Container} scene
 * @param {Container|null} light
 * @returns {Walk}
 */
function describe(scene, light) {
    const h = scene.header;
    const home = h.cameras[0] ?? overview(h.bounds);
    return {
        name: h.name,
        generator: h.generator,
        live: h.live,
        base: new URL(".", document.baseURI).href,
        up: h.up,
        centre: h.centre,
        radius: h.radius,
        bounds: h.bounds,
        cameras: h.cameras,
        home,
        unit: { name: h.unit, factor: 1 },
        materials: h.materials,
        stats: { ...h.stats, rays: light?.header.rays ?? 0, error: light?.header.relativeError ?? NaN },
        scene,
        light,
    };
}

/**
 * A view of everything, for scenes without a camera.
 * @param {[Vec3, Vec3]} bounds
 * @returns {Pose}
 */
function overview([low, high]) {
    const size = Math.hypot(...low.map((x, k) => high[k] - x));
    const forward = /** @type {Vec3} */ ([-0.5, -0.35, -0.8].map((x) => x / Math.hypot(0.5, 0.35, 0.8)));
    const eye = /** @type {Vec3} */ (low.map((x, k) => 0.5 * (x + high[k]) - 0.9 * size * forward[k]));
    return { eye, forward, up: [0, 1, 0], fov: 0.8 };
}

/**
 * @param {string} name
 * @returns {Promise<Container>}
 */
async function fetched(name) {
    const answer = await fetch(name);
    if (!answer.ok) throw new Error(`the server does not give the scene: ${await answer.text()}`);
    return readContainer(await answer.arrayBuffer());
}

/**
 * @param {HTMLElement|null} element that holds base64 of gzip
 * @returns {Promise<Container>}
 */
async function unpacked(element) {
    if (!element) throw new Error("this file is incomplete: its data are missing");
    const text = atob(element.textContent ?? "");
    // Its text is no longer needed, and large.
    element.textContent = "";
    const bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
    return readContainer(await new Response(stream).arrayBuffer());
}
