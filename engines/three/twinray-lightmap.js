/**
 * Lightmaps of `twinray bake` for the GLTFLoader of three.js:
 *
 *     import { TwinrayLightmap } from "./twinray-lightmap.js";
 *     const loader = new GLTFLoader().register((parser) => new TwinrayLightmap(parser));
 *
 * Materials get a `lightMap` of irradiance in the units of the scene (lux where radiance is in nit), as three.js takes it.
 * Show it with `renderer.toneMappingExposure`, which a scene of a few hundred lux wants near 0.01. The picture is KTX2, RGB9E5
 * packed by zlib, which browsers unpack themselves: nothing else has to be installed.
 */

import { ClampToEdgeWrapping, DataTexture, LinearFilter, NoColorSpace, RGBFormat, UnsignedInt5999Type } from "three";

const NAME = "TWINRAY_lightmap";
/** VK_FORMAT_E5B9G9R9_UFLOAT_PACK32. */
const RGB9E5 = 123;
const [PLAIN, ZLIB] = [0, 3];

export class TwinrayLightmap {
    /** @param {import("three/addons/loaders/GLTFLoader.js").GLTFParser} parser */
    constructor(parser) {
        this.parser = parser;
        this.name = NAME;
        /** @type {Map<number, Promise<DataTexture>>} */
        this.textures = new Map();
    }

    /**
     * Called by the loader for every material.
     * @param {number} index
     * @param {Record<string, unknown>} params
     */
    async extendMaterialParams(index, params) {
        const { json } = this.parser;
        const extension = json.materials[index].extensions?.[NAME];
        if (!extension) return;
        if (extension.quantity !== "irradiance") throw new Error(`${NAME}: unknown quantity ${extension.quantity}`);
        let texture = this.textures.get(extension.image);
        if (!texture) {
            texture = this.load(extension.image, extension.texCoord ?? 1);
            this.textures.set(extension.image, texture);
        }
        params.lightMap = await texture;
        params.lightMapIntensity = extension.scale ?? 1;
    }

    /**
     * @param {number} image
     * @param {number} channel
     */
    async load(image, channel) {
        const { bufferView, name } = this.parser.json.images[image];
        const { width, height, texels } = await unpack(await this.parser.getDependency("bufferView", bufferView));
        const texture = new DataTexture(texels, width, height, RGBFormat, UnsignedInt5999Type);
        texture.name = name;
        texture.channel = channel;
        texture.colorSpace = NoColorSpace;
        texture.flipY = false;
        texture.magFilter = texture.minFilter = LinearFilter;
        texture.wrapS = texture.wrapT = ClampToEdgeWrapping;
        texture.generateMipmaps = false;
        texture.needsUpdate = true;
        return texture;
    }
}

/**
 * The texels of a KTX2 file as `twinray bake` writes it (Khronos, "KTX file format specification", version 2).
 * @param {ArrayBuffer} file
 */
async function unpack(file) {
    const view = new DataView(file);
    const word = (/** @type {number} */ at) => view.getUint32(at, true);
    if (word(0) !== 0x58544bab || word(12) !== RGB9E5) throw new Error(`${NAME}: expected a KTX2 file of RGB9E5`);
    const [width, height, packing] = [word(20), word(24), word(44)];
    // The index of levels follows the header of 80 bytes; offsets and lengths have 64 bits.
    const [offset, length] = [80, 88].map((at) => Number(view.getBigUint64(at, true)));
    const level = new Uint8Array(file, offset, length);
    if (packing !== PLAIN && packing !== ZLIB) throw new Error(`${NAME}: unknown packing ${packing}`);
    const stream = new Blob([level]).stream();
    const plain = packing === ZLIB ? stream.pipeThrough(new DecompressionStream("deflate")) : stream;
    const texels = new Uint32Array(await new Response(plain).arrayBuffer());
    if (texels.length !== width * height) throw new Error(`${NAME}: expected ${width} x ${height} texels`);
    return { width, height, texels };
}
