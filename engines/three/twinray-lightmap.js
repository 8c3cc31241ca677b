/**
 * Lightmaps, and light at vertices, of `twinray bake` for the GLTFLoader of three.js:
 *
 *     import { TwinrayLightmap } from "./twinray-lightmap.js";
 *     const loader = new GLTFLoader().register((parser) => new TwinrayLightmap(parser));
 *
 * Materials get a `lightMap` of irradiance in the units of the scene (lux where radiance is in nit), as three.js takes it.
 * Show it with `renderer.toneMappingExposure`, which a scene of a few hundred lux wants near 0.01. The picture is KTX2, RGB9E5
 * packed by zlib, which browsers unpack themselves: nothing else has to be installed.
 *
 * Meshes with light at their vertices (`--to vertex`) get materials that add it as a lightmap would be added.
 */

import { ClampToEdgeWrapping, DataTexture, LinearFilter, NoColorSpace, RGBFormat, UnsignedInt5999Type } from "three";

const NAME = "TWINRAY_lightmap";
/** VK_FORMAT_E5B9G9R9_UFLOAT_PACK32. */
const RGB9E5 = 123;
const [PLAIN, ZLIB] = [0, 3];
/** What GLTFLoader makes of `_IRRADIANCE`. */
const IRRADIANCE = "_irradiance";

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
     * Called by the loader at the end.
     * @param {import("three/addons/loaders/GLTFLoader.js").GLTF} gltf
     */
    async afterRoot(gltf) {
        /** @type {Map<import("three").Material, import("three").Material>} */
        const lit = new Map();
        const litOf = (/** @type {import("three").Material} */ material, /** @type {boolean} */ hasColours) => {
            let found = lit.get(material);
            if (!found) lit.set(material, (found = withVertexLight(material, hasColours)));
            return found;
        };
        for (const scene of gltf.scenes) {
            scene.traverse((object) => {
                const mesh = /** @type {import("three").Mesh} */ (object);
                if (!mesh.isMesh || !mesh.geometry.attributes[IRRADIANCE]) return;
                // The light is in COLOR_0 too, for viewers that know nothing of it; the author's colours have moved.
                const colours = mesh.geometry.attributes.color_1;
                mesh.geometry.deleteAttribute("color");
                if (colours) mesh.geometry.setAttribute("color", colours);
                mesh.material = Array.isArray(mesh.material)
                    ? mesh.material.map((material) => litOf(material, Boolean(colours)))
                    : litOf(mesh.material, Boolean(colours));
            });
        }
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
 * A copy of a material that adds irradiance at vertices to that of lights.
 * @param {import("three").Material} material
 * @param {boolean} hasColours
 */
function withVertexLight(material, hasColours) {
    const lit = material.clone();
    lit.vertexColors = hasColours;
    lit.onBeforeCompile = (shader) => {
        const declared = "varying vec3 vTwinrayIrradiance;\n";
        shader.vertexShader = `attribute vec3 ${IRRADIANCE};\n${declared}${shader.vertexShader}`.replace(
            "#include <begin_vertex>",
            `#include <begin_vertex>\nvTwinrayIrradiance = ${IRRADIANCE};`,
        );
        shader.fragmentShader = `${declared}${shader.fragmentShader}`.replace(
            "#include <lights_fragment_maps>",
            "#include <lights_fragment_maps>\n#ifdef RE_IndirectDiffuse\nirradiance += vTwinrayIrradiance;\n#endif",
        );
    };
    lit.customProgramCacheKey = () => "twinray vertex light";
    return lit;
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
