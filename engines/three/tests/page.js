/** Shows a baked file from its first camera and compares radiance with a picture of twinray, in linear numbers. */

import * as THREE from "three";
import { EXRLoader } from "three/addons/loaders/EXRLoader.js";
import { GLTFLoader } from "three/addons/loaders/GLTFLoader.js";

import { TwinrayLightmap } from "/twinray-lightmap.js";

/** Side of the squares of pixels that are compared. */
const SQUARE = 8;

/** Luminance of linear BT.709. */
const luminance = (/** @type {ArrayLike<number>} */ p, /** @type {number} */ i) =>
    0.2126 * p[i] + 0.7152 * p[i + 1] + 0.0722 * p[i + 2];

/** @param {string} file @param {number} width @param {number} height */
async function radiance(file, width, height) {
    const loader = new GLTFLoader().register((parser) => new TwinrayLightmap(parser));
    const gltf = await loader.loadAsync(file);
    const renderer = new THREE.WebGLRenderer({ antialias: false, preserveDrawingBuffer: true });
    renderer.setSize(width, height);
    document.body.append(renderer.domElement);
    const camera = /** @type {THREE.PerspectiveCamera} */ (gltf.cameras[0]);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
    gltf.scene.updateMatrixWorld(true);
    const target = new THREE.WebGLRenderTarget(width, height, { type: THREE.FloatType, samples: 4 });
    renderer.setRenderTarget(target);
    renderer.render(gltf.scene, camera);
    const pixels = new Float32Array(4 * width * height);
    renderer.readRenderTargetPixels(target, 0, 0, width, height, pixels);
    renderer.setRenderTarget(null);
    return { pixels, renderer, gltf, camera };
}

/**
 * Ratio of the means over pixels where neither shows a lamp, and how far single pixels are from twinray's.
 * @param {string} file @param {string} picture
 */
async function compare(file, picture) {
    const reference = await new EXRLoader().setDataType(THREE.FloatType).loadAsync(picture);
    const { width, height, data } = reference.image;
    const { pixels, renderer, gltf, camera } = await radiance(file, width, height);
    let [mine, theirs, count] = [0, 0, 0];
    // Squares of pixels: single ones have the noise of twinray's own rays.
    const across = Math.ceil(width / SQUARE);
    const squares = Array.from({ length: across * Math.ceil(height / SQUARE) }, () => [0, 0]);
    const bright = brightest(data) * 0.15;
    for (let i = 0; i < data.length; i += 4) {
        const [a, b] = [luminance(pixels, i), luminance(data, i)];
        if (b > bright || a > bright) continue;
        mine += a;
        theirs += b;
        count += 1;
        const [x, y] = [(i / 4) % width, Math.floor(i / 4 / width)];
        const square = squares[Math.floor(y / SQUARE) * across + Math.floor(x / SQUARE)];
        square[0] += a;
        square[1] += b;
    }
    const ratios = squares.filter(([, b]) => b > 0).map(([a, b]) => a / b);
    ratios.sort((a, b) => a - b);
    // For whoever looks at it.
    renderer.toneMapping = THREE.AgXToneMapping;
    renderer.toneMappingExposure = 0.2 / (theirs / count);
    renderer.render(gltf.scene, camera);
    return {
        width,
        height,
        ratio: mine / theirs,
        median: ratios[ratios.length >> 1],
        // Half of the squares are nearer than this to twinray's, nine of ten than that; what is beyond are edges.
        ...deviations(ratios),
        lightmaps: [...materials(gltf.scene)].filter((m) => m.lightMap).length,
        coloured: [...materials(gltf.scene)].filter((m) => m.vertexColors).length,
        lights: [...lights(gltf.scene)].length,
    };
}

/** @param {number[]} ratios */
function deviations(ratios) {
    const sorted = ratios.map((r) => Math.abs(r - 1)).sort((a, b) => a - b);
    const at = (/** @type {number} */ share) => sorted[Math.floor(share * (sorted.length - 1))];
    return { p50: at(0.5), p90: at(0.9) };
}

/** @param {ArrayLike<number>} data */
function brightest(data) {
    let most = 0;
    for (let i = 0; i < data.length; i += 4) most = Math.max(most, luminance(data, i));
    return most;
}

/** @param {THREE.Object3D} scene */
function* materials(scene) {
    /** @type {THREE.Mesh[]} */
    const meshes = [];
    scene.traverse((o) => o instanceof THREE.Mesh && meshes.push(o));
    for (const mesh of meshes) yield /** @type {THREE.MeshStandardMaterial} */ (mesh.material);
}

/** @param {THREE.Object3D} scene */
function* lights(scene) {
    /** @type {THREE.Light[]} */
    const found = [];
    scene.traverse((o) => o instanceof THREE.Light && found.push(o));
    yield* found;
}

Object.assign(window, { compare });
document.body.dataset.page = "ready";
