// What the graphics processor holds of a scene: vertices, records, materials, textures, and the light, which changes.

/** @import { Container, Walk } from "twinray/types.js" */

/** Texels in a row of data textures. */
export const ROW = 2048;
/** Texels of a material. */
export const MATERIAL_TEXELS = 14;
/** Texels of a node's directions. */
const DIRECTION_TEXELS = 6;

/**
 * @typedef {object} Batch
 * @property {number} start triangle
 * @property {number} count triangles
 * @property {boolean} seeThrough
 * @property {boolean} twoSided
 * @property {(WebGLTexture|null)[]} textures base colour, emission, metalness and roughness, normals
 */

export class Resources {
    /**
     * @param {WebGL2RenderingContext} gl
     * @param {Walk} walk
     * @param {() => void} onTexture called when a picture has come
     */
    constructor(gl, walk, onTexture) {
        const { header, arrays } = walk.scene;
        this.gl = gl;
        this.walk = walk;
        this.glossySlots = header.glossy.slots;
        /** @type {Uint32Array} */
        this.nodes = /** @type {any} */ (arrays.nodes);
        /** @type {Uint32Array} */
        this.records = /** @type {any} */ (arrays.triangles);
        this.vertices = vertexArray(gl, walk.scene);
        this.triangles = dataTexture(gl, "RGBA32UI", arrays.triangles, 4);
        this.materials = dataTexture(gl, "RGBA32F", materialTexels(header.materials), 4);
        const table = header.table;
        this.albedos = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, this.albedos);
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, table + 1, table, 0, gl.RGBA, gl.FLOAT, arrays.albedos);
        filter(gl, gl.LINEAR, gl.CLAMP_TO_EDGE, gl.CLAMP_TO_EDGE);
        this.sky = null;
        if (header.sky) {
            const { width, height } = header.sky;
            this.sky = gl.createTexture();
            gl.bindTexture(gl.TEXTURE_2D, this.sky);
            const type = gl.UNSIGNED_INT_5_9_9_9_REV;
            gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB9_E5, width, height, 0, gl.RGB, type, arrays.sky);
            filter(gl, gl.LINEAR, gl.REPEAT, gl.CLAMP_TO_EDGE);
        }
        const images = new Images(gl, walk.scene, onTexture);
        /** @type {Batch[]} */
        this.batches = header.batches.map((/** @type {any} */ b) => {
            const t = header.materials[b.material].textures;
            const of = (/** @type {any} */ slot) => (slot ? images.texture(slot) : null);
            return { ...b, textures: [of(t.base), of(t.emission), of(t.metallicRoughness), of(t.normal)] };
        });
        this.ready = images.ready;
        /** Light as it was last given, per node. */
        this.light = {
            irradiance: new Uint32Array(header.stats.nodes),
            error: new Uint8Array(header.stats.nodes).fill(255),
            scale: 1,
            radianceScale: 1,
            lampScale: 1,
            sampleScale: 1,
            hasSamples: false,
            isFinal: false,
        };
        const slots = this.nodes.length;
        const glossy = Math.max(1, this.glossySlots);
        this.irradiance = dataTexture(gl, "RGB9_E5", new Uint32Array(slots), 1);
        this.radiance = dataTexture(gl, "RGB9_E5", new Uint32Array(glossy), 1);
        this.directions = dataTexture(gl, "RGBA8_SNORM", new Int8Array(4 * DIRECTION_TEXELS * glossy), 4);
        this.lamps = dataTexture(gl, "RG32UI", new Uint32Array(2 * glossy), 2);
        this.samples = dataTexture(gl, "RG32UI", new Uint32Array(2 * Math.max(1, header.glossy.cells)), 2);
    }

    /**
     * Takes new light, or new samples alone.
     * @param {Container} container
     */
    setLight({ header, arrays }) {
        const { gl, light, nodes, glossySlots } = this;
        if (header.kind === "light") {
            if (arrays.irradiance.length !== light.irradiance.length) throw new Error("light of another scene");
            light.irradiance = /** @type {Uint32Array} */ (arrays.irradiance);
            light.error = /** @type {Uint8Array} */ (arrays.error);
            light.scale = header.scale;
            light.isFinal = header.final;
            light.radianceScale = header.radianceScale;
            light.lampScale = header.lampScale;
            const irradiance = new Uint32Array(nodes.length);
            for (let slot = 0; slot < nodes.length; slot++) irradiance[slot] = light.irradiance[nodes[slot]];
            fill(gl, this.irradiance, "RGB9_E5", irradiance, 1);
            if (glossySlots > 0) {
                const radiance = new Uint32Array(glossySlots);
                const lamps = new Uint32Array(2 * glossySlots);
                const directions = new Int8Array(4 * DIRECTION_TEXELS * glossySlots);
                const [from, bytes] = [/** @type {Int8Array} */ (arrays.directions), 4 * DIRECTION_TEXELS];
                for (let slot = 0; slot < glossySlots; slot++) {
                    const node = nodes[slot];
                    radiance[slot] = arrays.radiance[node];
                    lamps[2 * slot] = arrays.lamps[2 * node];
                    lamps[2 * slot + 1] = arrays.lamps[2 * node + 1];
                    directions.set(from.subarray(bytes * node, bytes * (node + 1)), bytes * slot);
                }
                fill(gl, this.radiance, "RGB9_E5", radiance, 1);
                fill(gl, this.lamps, "RG32UI", lamps, 2);
                fill(gl, this.directions, "RGBA8_SNORM", directions, 4);
            }
        }
        light.hasSamples = arrays.samples.length > 0;
        if (light.hasSamples) {
            light.sampleScale = header.sampleScale;
            fill(gl, this.samples, "RG32UI", arrays.samples, 2);
        }
    }

    dispose() {
        // The context goes with the page; its loss frees everything at once.
        this.gl.getExtension("WEBGL_lose_context")?.loseContext();
    }
}

/**
 * One vertex a corner, since a triangle's number is that of its vertices.
 * @param {WebGL2RenderingContext} gl
 * @param {Container} scene
 */
function vertexArray(gl, { arrays }) {
    const { positions, normals, texcoords, corners } = arrays;
    const count = corners.length;
    const expand = (/** @type {any} */ from, /** @type {number} */ width, /** @type {any} */ Type) => {
        const to = new Type(width * count);
        for (let i = 0; i < count; i++)
            for (let k = 0; k < width; k++) to[width * i + k] = from[width * corners[i] + k];
        return to;
    };
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    const attribute = (/** @type {number} */ place, /** @type {any} */ data, /** @type {number} */ width) => {
        gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
        gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
        gl.enableVertexAttribArray(place);
        const short = data instanceof Int16Array;
        gl.vertexAttribPointer(place, width, short ? gl.SHORT : gl.FLOAT, short, 0, 0);
    };
    attribute(0, expand(positions, 3, Float32Array), 3);
    attribute(1, expand(normals, 2, Int16Array), 2);
    if (texcoords) attribute(2, expand(texcoords, 4, Float32Array), 4);
    gl.bindVertexArray(null);
    return array;
}

/** @type {Record<string, [string, string, any]>} */
const FORMATS = {
    RGBA32UI: ["RGBA_INTEGER", "UNSIGNED_INT", Uint32Array],
    RG32UI: ["RG_INTEGER", "UNSIGNED_INT", Uint32Array],
    RGBA32F: ["RGBA", "FLOAT", Float32Array],
    RGB9_E5: ["RGB", "UNSIGNED_INT_5_9_9_9_REV", Uint32Array],
    RGBA8_SNORM: ["RGBA", "BYTE", Int8Array],
};

/**
 * A texture of numbers, `width` of them a texel, ROW texels a row.
 * @param {WebGL2RenderingContext} gl
 * @param {string} format
 * @param {any} numbers
 * @param {number} width
 */
function dataTexture(gl, format, numbers, width) {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    const rows = Math.max(1, Math.ceil(numbers.length / (width * ROW)));
    if (rows > gl.getParameter(gl.MAX_TEXTURE_SIZE)) {
        throw new Error("this scene has more cells than this graphics processor can hold: take fewer --patches");
    }
    // @ts-ignore: names of formats are constants of the context
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl[format], ROW, rows);
    filter(gl, gl.NEAREST, gl.CLAMP_TO_EDGE, gl.CLAMP_TO_EDGE);
    fill(gl, texture, format, numbers, width);
    return texture;
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {WebGLTexture|null} texture
 * @param {string} format
 * @param {any} numbers
 * @param {number} width
 */
function fill(gl, texture, format, numbers, width) {
    const [layout, type, Type] = FORMATS[format];
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    const whole = Math.floor(numbers.length / (width * ROW));
    // @ts-ignore: names of formats are constants of the context
    const [f, t] = [gl[layout], gl[type]];
    if (whole > 0) gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, ROW, whole, f, t, numbers, 0);
    const rest = numbers.length - whole * width * ROW;
    if (rest > 0) {
        const last = new Type(numbers.buffer, numbers.byteOffset + whole * width * ROW * Type.BYTES_PER_ELEMENT, rest);
        gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, whole, rest / width, 1, f, t, last);
    }
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {number} kind
 * @param {number} s
 * @param {number} t
 */
function filter(gl, kind, s, t) {
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, kind);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, kind);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, s);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, t);
}

const KINDS = ["lambertian", "metallic-roughness", "phong"];

/**
 * What shaders read of materials, MATERIAL_TEXELS texels each.
 * @param {any[]} materials
 */
function materialTexels(materials) {
    const texels = [];
    for (const m of materials) {
        const s = m.surface;
        const kind = KINDS.indexOf(s.kind);
        const normal = ((s.ior ?? 1.5) - 1) / ((s.ior ?? 1.5) + 1);
        texels.push(...s.color, m.alpha);
        texels.push(...m.emission, kind);
        texels.push(s.metallic ?? 0, s.roughness ?? 1, kind === 1 ? s.specular : 1, normal * normal);
        texels.push(...(s.specularColor ?? [1, 1, 1]), m.transmission);
        texels.push(m.cutoff ?? -1, m.blend ? 1 : 0, s.exponent ?? 1, m.normalScale);
        texels.push(...(kind === 2 ? s.specular : [0, 0, 0]), 0);
        for (const slot of [m.textures.base, m.textures.emission, m.textures.metallicRoughness, m.textures.normal]) {
            const [a, b, c, d, x, y] = slot?.matrix ?? [1, 0, 0, 1, 0, 0];
            texels.push(a, b, c, d, x, y, slot?.set ?? 0, slot ? 1 : 0);
        }
    }
    return new Float32Array(texels);
}

/** Pictures, which are decoded one after the other while the scene is shown already. */
class Images {
    /**
     * @param {WebGL2RenderingContext} gl
     * @param {Container} scene
     * @param {() => void} onTexture
     */
    constructor(gl, { header, arrays }, onTexture) {
        this.gl = gl;
        this.header = header;
        this.arrays = arrays;
        this.onTexture = onTexture;
        /** @type {Map<string, WebGLTexture|null>} */
        this.textures = new Map();
        /** @type {Promise<void>[]} */
        this.pending = [];
        this.anisotropy = gl.getExtension("EXT_texture_filter_anisotropic");
    }

    /** Settles when all pictures are there. */
    get ready() {
        return Promise.all(this.pending).then(() => undefined);
    }

    /**
     * @param {any} slot a texture of a material
     * @returns {WebGLTexture|null}
     */
    texture(slot) {
        const key = JSON.stringify([slot.image, slot.wrap, slot.nearest]);
        const known = this.textures.get(key);
        if (known !== undefined) return known;
        const { gl } = this;
        const texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texImage2D(
            gl.TEXTURE_2D,
            0,
            gl.RGBA8,
            1,
            1,
            0,
            gl.RGBA,
            gl.UNSIGNED_BYTE,
            new Uint8Array([255, 255, 255, 255]),
        );
        this.textures.set(key, texture);
        this.pending.push(this.#load(texture, slot));
        return texture;
    }

    /**
     * @param {WebGLTexture|null} texture
     * @param {any} slot
     */
    async #load(texture, slot) {
        const { gl } = this;
        const image = this.header.images[slot.image];
        const bytes = /** @type {any} */ (this.arrays[image.array]);
        const blob = new Blob([bytes], { type: image.type });
        let picture;
        try {
            picture = await createImageBitmap(blob, { colorSpaceConversion: "none", premultiplyAlpha: "none" });
        } catch {
            console.warn(`the texture ${image.name} cannot be read`);
            return;
        }
        gl.bindTexture(gl.TEXTURE_2D, texture);
        const format = image.colour ? gl.SRGB8_ALPHA8 : gl.RGBA8;
        gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);
        gl.texImage2D(gl.TEXTURE_2D, 0, format, gl.RGBA, gl.UNSIGNED_BYTE, picture);
        picture.close();
        const wraps = { repeat: gl.REPEAT, mirror: gl.MIRRORED_REPEAT, clamp: gl.CLAMP_TO_EDGE };
        const [s, t] = slot.wrap.map((/** @type {keyof typeof wraps} */ w) => wraps[w]);
        filter(gl, slot.nearest ? gl.NEAREST : gl.LINEAR, s, t);
        if (!slot.nearest) {
            gl.generateMipmap(gl.TEXTURE_2D);
            gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR_MIPMAP_LINEAR);
            if (this.anisotropy) gl.texParameterf(gl.TEXTURE_2D, this.anisotropy.TEXTURE_MAX_ANISOTROPY_EXT, 8);
        }
        this.onTexture();
    }
}
