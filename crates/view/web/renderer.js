// Pictures of a walk: frames while the view moves, their means while it rests, and what lies under a point.

import { Resources } from "twinray/resources.js";
import { SeeThrough } from "twinray/see-through.js";
import { matrices } from "twinray/projection.js";
import { find, irradianceAt, medianRange } from "twinray/lookup.js";
import {
    FILM_VERTEX,
    MEAN_FRAGMENT,
    METER_FRAGMENT,
    PICK_FRAGMENT,
    PIECE_VERTEX,
    SHOW_FRAGMENT,
    SKY_FRAGMENT,
    SURFACE_FRAGMENT,
    SURFACE_VERTEX,
} from "twinray/shaders.js";

/** @import { Container, FrameInfo, Options, Pick, Pose, Vec3, Walk } from "twinray/types.js" */

/** Frames of which a resting view is the mean. */
const FRAMES = 48;
/** The same where a frame takes long. */
const FEW_FRAMES = 16;
/** Milliseconds beyond which frames take long, and while moving are made coarser. */
const SLOW = 45;
/** Log-average luminance becomes this: crates/render/src/display/exposure.rs. */
const MIDDLE_GREY = 0.2;
/**
 * How many updates of samples weigh as much as what is known of all directions. Measured on the hall's glossy floor, in squares
 * of 8 pixels: one update leaves 96 % of noise, what is known is 2.5 % off. The ratio of the squares is the weight with the
 * least error; samples never make a view worse, and are all that counts in the end.
 */
const PRIOR = 1500;
/** Points across the film at which automatic exposure looks. */
const METER = 48;
const CURVES = ["agx", "aces", "reinhard", "none"];

export class Renderer {
    /** Called after every frame. @type {((info: FrameInfo) => void)|null} */
    onframe = null;
    /** Called where the graphics processor was taken away. @type {(() => void)|null} */
    onlost = null;
    /** @type {Options} */
    options = {
        exposure: null,
        curve: "agx",
        falseColour: false,
        range: null,
        logarithmic: false,
        cells: false,
        colours: new Uint8Array(4 * 256),
    };

    /** @type {Pose|null} */
    #view = null;
    #requested = 0;
    /** Frames in the mean. */
    #frames = 0;
    /** Frames in the mean of samples: it goes on over new light, since only many of them say anything. */
    #sampledFrames = 0;
    /** Frames ever drawn. */
    #drawn = 0;
    #moving = false;
    /** Exposure in use and wanted, EV; what frames were multiplied by. */
    #exposure = NaN;
    #target = NaN;
    #baked = 1;
    /** Updates of samples since the view rests. */
    #updates = 0;
    #slow = false;
    #lastFrame = 0;
    /** Whether the next frame was asked for by this one. */
    #follows = false;
    /** @type {[number, number]} */
    #range = [0, 1];
    #hasLight = false;
    #disposed = false;

    /**
     * @param {HTMLCanvasElement} canvas
     * @param {Walk} walk
     */
    constructor(canvas, walk) {
        const gl = canvas.getContext("webgl2", {
            antialias: false,
            alpha: false,
            depth: false,
            powerPreference: "high-performance",
        });
        if (!gl) throw new Error("this browser has no WebGL 2, which the walk-through draws with");
        if (!gl.getExtension("EXT_color_buffer_float")) {
            throw new Error(
                "this graphics processor cannot draw into floating-point pictures (EXT_color_buffer_float)",
            );
        }
        this.canvas = canvas;
        this.walk = walk;
        this.gl = gl;
        this.programs = {
            surface: program(gl, SURFACE_VERTEX, SURFACE_FRAGMENT),
            sky: program(gl, FILM_VERTEX, SKY_FRAGMENT),
            pick: program(gl, SURFACE_VERTEX, PICK_FRAGMENT),
            mean: program(gl, FILM_VERTEX, MEAN_FRAGMENT),
            meter: program(gl, FILM_VERTEX, METER_FRAGMENT),
            show: program(gl, FILM_VERTEX, SHOW_FRAGMENT),
        };
        this.resources = new Resources(gl, walk, () => this.#restart());
        const panes = this.resources.batches.filter((batch) => batch.seeThrough);
        /** Another shader, and a tree of planes, only where there is something to see through. */
        this.seeThrough = panes.length > 0 ? new SeeThrough(gl, walk, panes) : null;
        this.pieces = this.seeThrough && program(gl, PIECE_VERTEX, SURFACE_FRAGMENT);
        this.empty = gl.createVertexArray();
        this.white = pixel(gl, [255, 255, 255, 255]);
        this.flat = pixel(gl, [128, 128, 255, 255]);
        this.black = pixel(gl, [0, 0, 0, 255]);
        this.colours = pixel(gl, [255, 255, 255, 255]);
        this.meter = target(gl, METER, METER, [gl.RGBA16F], false);
        this.picked = target(gl, 1, 1, [gl.RGBA32UI], true);
        /** @type {Target|null} */
        this.frame = null;
        /** @type {Target[]} */
        this.means = [];
        canvas.addEventListener("webglcontextlost", (event) => {
            event.preventDefault();
            if (!this.#disposed) this.onlost?.();
        });
        canvas.addEventListener("webglcontextrestored", () => {
            if (!this.#disposed) location.reload();
        });
        this.resize();
        if (walk.light) this.setLight(walk.light);
    }

    /** Settles when all textures are there. */
    get ready() {
        return this.resources.ready;
    }

    /** Exposure in use, EV. */
    get exposure() {
        return this.options.exposure ?? this.#exposure;
    }

    /** Frames in the picture that is shown, whether more will come, updates of samples in it, and whether better light will. */
    get state() {
        return {
            frames: this.#frames,
            resting: this.#requested === 0,
            updates: this.#updates,
            isFinal: this.resources.light.isFinal,
        };
    }

    /** @param {Pose} view */
    setView(view) {
        this.#view = { ...view };
        this.#moving = true;
        this.#restart();
    }

    /** @param {Partial<Options>} options */
    setOptions(options) {
        const before = this.options;
        this.options = { ...before, ...options };
        if (options.colours && options.colours !== before.colours) {
            const { gl } = this;
            gl.bindTexture(gl.TEXTURE_2D, this.colours);
            gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, options.colours);
            gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
            gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
        }
        const drawn = ["falseColour", "cells", "exposure"];
        // @ts-ignore: names of options
        if (drawn.some((name) => this.options[name] !== before[name])) this.#restart();
        else this.#request();
    }

    /**
     * New light, or new samples.
     * @param {Container} container
     */
    setLight(container) {
        this.resources.setLight(container);
        this.#hasLight = true;
        if (container.header.kind === "light") {
            this.#range = medianRange(this.resources.light);
            // What is new counts for most of the mean from now on; its edges stay smooth.
            this.#frames = Math.min(this.#frames, 3);
        }
        if (this.resources.light.hasSamples) {
            this.#updates += 1;
            this.#frames = Math.min(this.#frames, FEW_FRAMES);
        }
        this.#request();
    }

    /** Takes over the size of the canvas on the page. */
    resize() {
        const { canvas, gl } = this;
        const ratio = Math.min(globalThis.devicePixelRatio || 1, 2);
        const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
        const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
        if (this.frame && canvas.width === width && canvas.height === height) return;
        canvas.width = width;
        canvas.height = height;
        for (const t of [this.frame, ...this.means]) if (t) free(gl, t);
        this.frame = target(gl, width, height, [gl.RGBA16F, gl.RGBA16F], true);
        this.means = [0, 1].map(() => target(gl, width, height, [gl.RGBA32F, gl.RGBA32F], false));
        this.#restart();
    }

    /**
     * What lies under a point of the canvas.
     * @param {number} x in CSS pixels
     * @param {number} y
     * @returns {Promise<Pick|null>}
     */
    async pick(x, y) {
        const { gl, canvas, walk, resources } = this;
        if (!this.#view || gl.isContextLost()) return null;
        const [width, height] = [canvas.clientWidth, canvas.clientHeight];
        const at = [(2 * (x + 0.5)) / width - 1, 1 - (2 * (y + 0.5)) / height];
        const { viewProjection } = matrices(
            this.#view,
            width / height,
            walk,
            at.map((c) => -c),
            [width, height],
        );
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.picked.framebuffer);
        gl.viewport(0, 0, 1, 1);
        gl.clearBufferuiv(gl.COLOR, 0, [0, 0, 0, 0]);
        gl.clearBufferfv(gl.DEPTH, 0, [1]);
        this.#drawSurfaces(this.programs.pick, viewProjection);
        const found = new Uint32Array(4);
        gl.readPixels(0, 0, 1, 1, gl.RGBA_INTEGER, gl.UNSIGNED_INT, found);
        if (found[0] === 0) return null;
        const places = new Float32Array(found.buffer, 4, 2);
        const place = find(walk, resources, found[0] - 1, places[0], places[1], found[3] === 1);
        const light = irradianceAt(resources, place);
        const offset = place.point.map((c, k) => c - /** @type {Pose} */ (this.#view).eye[k]);
        return {
            point: place.point,
            normal: place.normal,
            distance: Math.hypot(...offset),
            irradiance: light.irradiance,
            illuminance: light.illuminance * walk.unit.factor,
            error: light.error,
            radiance: this.#radianceAt(x / width, 1 - y / height),
            material: walk.materials[place.material]?.name ?? "",
            cell: place.cell,
        };
    }

    /** The picture as a PNG file. @returns {Promise<Blob>} */
    screenshot() {
        if (this.gl.isContextLost()) return Promise.reject(new Error("there is no picture at the moment"));
        this.#show();
        return new Promise((done, fail) =>
            this.canvas.toBlob((blob) => (blob ? done(blob) : fail(new Error("no picture"))), "image/png"),
        );
    }

    dispose() {
        this.#disposed = true;
        cancelAnimationFrame(this.#requested);
        this.#requested = 0;
        this.resources.dispose();
    }

    #restart() {
        this.#frames = 0;
        this.#forgetSamples();
        this.#request();
    }

    #forgetSamples() {
        this.#sampledFrames = 0;
        this.#updates = this.resources?.light.hasSamples ? 1 : 0;
    }

    #request() {
        if (this.#requested === 0 && !this.#disposed) {
            this.#requested = requestAnimationFrame((time) => this.#draw(time));
        }
    }

    /** @param {number} time */
    #draw(time) {
        this.#requested = 0;
        if (!this.#view || !this.frame || !this.#hasLight || this.gl.isContextLost()) return;
        // Frames that follow each other tell how fast they are.
        if (this.#follows) this.#slow = time - this.#lastFrame > SLOW;
        this.#follows = false;
        this.#lastFrame = time;
        const moving = this.#moving;
        this.#moving = false;
        // One frame after the last move the view rests, and the mean begins.
        const coarse = moving && this.#slow ? 0.5 : 1;
        const size = [this.canvas.width, this.canvas.height].map((s) => Math.max(1, Math.round(s * coarse)));
        this.#bake();
        this.#drawFrame(this.#view, size);
        const { gl } = this;
        if (coarse === 1) {
            this.#frames += 1;
            this.#drawn += 1;
            const share = 1 / this.#frames;
            const { hasSamples } = this.resources.light;
            if (hasSamples) this.#sampledFrames += 1;
            this.means.reverse();
            const [to, from] = this.means;
            gl.bindFramebuffer(gl.FRAMEBUFFER, to.framebuffer);
            gl.viewport(0, 0, this.canvas.width, this.canvas.height);
            this.#film(this.programs.mean, {
                textures: {
                    uKnown: this.frame.textures[0],
                    uSampled: this.frame.textures[1],
                    uKnownMean: from.textures[0],
                    uSampledMean: from.textures[1],
                },
                // A light that is finished has no samples; what they have shown of this view stays.
                uShare: [share, hasSamples ? 1 / this.#sampledFrames : Number(this.#sampledFrames === 0)],
            });
        }
        const settled = this.#meter(moving);
        this.#coarse = coarse;
        this.#show();
        this.onframe?.({ exposure: this.exposure, samples: this.#frames, illuminanceRange: this.#range });
        if (coarse < 1 || !settled || this.#frames < (this.#slow ? FEW_FRAMES : FRAMES)) {
            this.#follows = true;
            this.#request();
        }
    }

    #coarse = 1;

    /** What frames are multiplied by: near enough to the exposure that nothing overflows and lamps are clipped in time. */
    #bake() {
        const wanted = this.options.falseColour
            ? 1 / Math.max(1e-12, this.#range[1])
            : 2 ** (this.options.exposure ?? (Number.isNaN(this.#exposure) ? this.#guess() : this.#exposure));
        const far = Math.abs(Math.log2(wanted / this.#baked));
        if (this.#frames === 0 || far > 2) {
            // What was added up was multiplied by another.
            if (this.#baked !== wanted) this.#forgetSamples();
            this.#baked = wanted;
            this.#frames = 0;
        }
    }

    /** An exposure before anything was seen: a white wall in mean light would be a middle grey. */
    #guess() {
        return Math.log2((MIDDLE_GREY * Math.PI) / Math.max(1e-12, 0.3 * this.#range[1]));
    }

    /**
     * @param {Pose} view
     * @param {number[]} size
     */
    #drawFrame(view, size) {
        const { gl, walk, resources, options } = this;
        const [width, height] = size;
        // The first frame is through the middle of pixels; the others make their mean smooth.
        const place = this.#frames === 0 ? 0 : 1 + (this.#drawn % 1024);
        const jitter = [2, 3].map((base, k) => ((halton(place, base) - 0.5) * 2) / size[k]);
        const { viewProjection, ray } = matrices(view, this.canvas.width / this.canvas.height, walk, jitter, [1, 1]);
        gl.bindFramebuffer(gl.FRAMEBUFFER, this.frame?.framebuffer ?? null);
        gl.viewport(0, 0, width, height);
        gl.disable(gl.BLEND);
        gl.depthMask(true);
        gl.clearBufferfv(gl.COLOR, 0, [0, 0, 0, 1]);
        gl.clearBufferfv(gl.COLOR, 1, [0, 0, 0, 0]);
        gl.clearBufferfv(gl.DEPTH, 0, [1]);
        const { light } = resources;
        const uniforms = {
            uEye: view.eye,
            uScales: [light.scale, light.radianceScale, light.sampleScale, this.#baked],
            uLampScale: light.lampScale,
            uGlossySlots: resources.glossySlots,
            uMode: options.falseColour ? 1 : 0,
            uCells: options.cells ? 1 : 0,
            uSampled: light.hasSamples ? 1 : 0,
            uSeed: [this.#drawn * 1.37, this.#drawn * 2.11, this.#drawn + 0.5],
        };
        this.#drawSurfaces(this.programs.surface, viewProjection, uniforms);
        gl.enable(gl.DEPTH_TEST);
        gl.depthFunc(gl.LEQUAL);
        const sky = resources.sky ? walk.scene.header.sky.scale * this.#baked : 0;
        this.#film(this.programs.sky, {
            textures: { uSky: resources.sky ?? this.black },
            uRay: ray,
            uScale: [sky, options.falseColour ? 1 : 0],
        });
        if (!options.falseColour) this.#drawSeeThrough(view, viewProjection, uniforms);
        gl.disable(gl.DEPTH_TEST);
    }

    /**
     * @param {Program} program
     * @param {Float32Array} viewProjection
     * @param {Record<string, any>} uniforms
     */
    #drawSurfaces(program, viewProjection, uniforms = {}) {
        const { gl, resources } = this;
        this.#prepare(program, viewProjection, { ...uniforms, uPass: 0 });
        gl.bindVertexArray(resources.vertices);
        for (const batch of resources.batches) {
            if (batch.seeThrough) continue;
            this.#take(program, batch);
            gl.drawArrays(gl.TRIANGLES, 3 * batch.start, 3 * batch.count);
        }
        gl.bindVertexArray(null);
        gl.disable(gl.CULL_FACE);
    }

    /**
     * What can be seen through, over all else, from the farthest to the nearest.
     * @param {Pose} view
     * @param {Float32Array} viewProjection
     * @param {Record<string, any>} uniforms
     */
    #drawSeeThrough(view, viewProjection, uniforms) {
        const { gl, seeThrough, pieces } = this;
        if (!seeThrough || !pieces) return;
        seeThrough.sort(view.eye);
        this.#prepare(pieces, viewProjection, uniforms);
        gl.enable(gl.BLEND);
        gl.depthMask(false);
        gl.bindVertexArray(seeThrough.vertices);
        /** @type {unknown} */
        let taken = null;
        for (const { start, count, batch, tinted } of seeThrough.runs) {
            if (taken !== batch) this.#take(pieces, batch);
            taken = batch;
            const draw = (/** @type {number} */ pass, /** @type {number} */ source, /** @type {number} */ behind) => {
                set(gl, pieces, { uPass: pass });
                gl.blendFunc(source, behind);
                gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 4 * start);
            };
            if (tinted) {
                draw(2, gl.ZERO, gl.SRC_COLOR);
                draw(3, gl.ONE, gl.ONE);
            } else draw(1, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
        }
        gl.bindVertexArray(null);
        gl.disable(gl.CULL_FACE);
        gl.depthMask(true);
        gl.disable(gl.BLEND);
    }

    /**
     * @param {Program} program
     * @param {Float32Array} viewProjection
     * @param {Record<string, any>} uniforms
     */
    #prepare(program, viewProjection, uniforms) {
        const { gl, resources } = this;
        gl.useProgram(program.handle);
        set(gl, program, {
            ...uniforms,
            uViewProjection: viewProjection,
            textures: {
                uTriangles: resources.triangles,
                uMaterials: resources.materials,
                uAlbedos: resources.albedos,
                uIrradiance: resources.irradiance,
                uRadiance: resources.radiance,
                uDirections: resources.directions,
                uSamples: resources.samples,
                uLamps: resources.lamps,
            },
        });
        gl.enable(gl.DEPTH_TEST);
        gl.depthFunc(gl.LESS);
        gl.cullFace(gl.BACK);
    }

    /**
     * Sides and textures of a batch.
     * @param {Program} program
     * @param {import("twinray/resources.js").Batch} batch
     */
    #take(program, batch) {
        const { gl } = this;
        if (batch.twoSided) gl.disable(gl.CULL_FACE);
        else gl.enable(gl.CULL_FACE);
        /** @type {Record<string, WebGLTexture|null>} */
        const textures = {};
        const names = ["uBase", "uEmission", "uMetal", "uBumps"];
        names.forEach((name, k) => (textures[name] = batch.textures[k] ?? (k === 3 ? this.flat : this.white)));
        set(gl, program, { textures, uHas: batch.textures.map((texture) => (texture ? 1 : 0)) });
    }

    /**
     * Draws over the whole film.
     * @param {Program} program
     * @param {Record<string, any>} uniforms
     */
    #film(program, uniforms) {
        const { gl } = this;
        gl.useProgram(program.handle);
        set(gl, program, uniforms);
        gl.bindVertexArray(this.empty);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
        gl.bindVertexArray(null);
    }

    /**
     * Follows the light with the exposure; true once it rests.
     * @param {boolean} moving
     */
    #meter(moving) {
        const { gl, options, means } = this;
        if (options.falseColour) return true;
        if (options.exposure !== null) {
            this.#exposure = options.exposure;
            return true;
        }
        const frames = this.#frames;
        if (frames > 0 && (frames <= 2 || frames % 8 === 0)) {
            gl.bindFramebuffer(gl.FRAMEBUFFER, this.meter.framebuffer);
            gl.viewport(0, 0, METER, METER);
            this.#film(this.programs.meter, {
                textures: { uKnown: means[0].textures[0], uSampled: means[0].textures[1] },
            });
            const numbers = new Float32Array(4 * METER * METER);
            gl.readPixels(0, 0, METER, METER, gl.RGBA, gl.FLOAT, numbers);
            let [sum, weight] = [0, 0];
            for (let i = 0; i < numbers.length; i += 4) {
                sum += numbers[i];
                weight += numbers[i + 1];
            }
            if (weight > 0 && Number.isFinite(sum)) this.#target = Math.log2(MIDDLE_GREY * this.#baked) - sum / weight;
        }
        if (Number.isNaN(this.#target)) return true;
        const off = this.#target - this.#exposure;
        // The eye follows; a first look is right at once.
        if (Number.isNaN(this.#exposure) || Math.abs(off) < 0.01) this.#exposure = this.#target;
        else this.#exposure += off * (moving ? 0.15 : 0.3);
        if (this.#exposure !== this.#target) return false;
        // Lamps were clipped for the exposure that was: once more for this one.
        if (!moving && Math.abs(Math.log2(2 ** this.#exposure / this.#baked)) > 0.05) this.#frames = 0;
        return true;
    }

    #show() {
        const { gl, options, canvas, frame } = this;
        if (!frame) return;
        const coarse = this.#coarse < 1;
        const [known, sampled] = (coarse ? frame : this.means[0]).textures;
        gl.bindFramebuffer(gl.FRAMEBUFFER, null);
        gl.viewport(0, 0, canvas.width, canvas.height);
        const range = options.range ?? this.#range;
        this.#film(this.programs.show, {
            textures: { uKnown: known, uSampled: sampled, uColours: this.colours },
            uSampledShare: this.#updates / (this.#updates + PRIOR),
            uGain: options.falseColour ? this.walk.unit.factor / this.#baked : 2 ** this.exposure / this.#baked,
            uCurve: options.falseColour ? 4 : CURVES.indexOf(options.curve),
            uRange: [range[0], range[1], options.logarithmic ? 1 : 0],
            uPart: this.#coarse,
        });
    }

    /**
     * @param {number} x share of the width
     * @param {number} y share of the height, from below
     * @returns {Vec3}
     */
    #radianceAt(x, y) {
        const { gl, canvas, means } = this;
        if (this.options.falseColour || this.#frames === 0) return [NaN, NaN, NaN];
        gl.bindFramebuffer(gl.FRAMEBUFFER, means[0].framebuffer);
        const at = [x * canvas.width, y * canvas.height].map(Math.floor);
        const sums = [0, 1].map((k) => {
            gl.readBuffer(gl.COLOR_ATTACHMENT0 + k);
            const numbers = new Float32Array(4);
            gl.readPixels(at[0], at[1], 1, 1, gl.RGBA, gl.FLOAT, numbers);
            return numbers;
        });
        gl.readBuffer(gl.COLOR_ATTACHMENT0);
        const share = this.#updates / (this.#updates + PRIOR);
        const of = (/** @type {number} */ k) => (sums[0][k] + share * sums[1][k]) / this.#baked;
        return [of(0), of(1), of(2)];
    }
}

/** @typedef {{framebuffer: WebGLFramebuffer|null, textures: (WebGLTexture|null)[], depth: WebGLRenderbuffer|null}} Target */
/** @typedef {{handle: WebGLProgram, uniforms: Map<string, {place: WebGLUniformLocation|null, type: number, unit: number}>}} Program */

/**
 * @param {WebGL2RenderingContext} gl
 * @param {string} vertex
 * @param {string} fragment
 * @returns {Program}
 */
function program(gl, vertex, fragment) {
    const handle = /** @type {WebGLProgram} */ (gl.createProgram());
    const sources = /** @type {[number, string][]} */ ([
        [gl.VERTEX_SHADER, vertex],
        [gl.FRAGMENT_SHADER, fragment],
    ]);
    for (const [kind, source] of sources) {
        const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
        gl.shaderSource(shader, source);
        gl.compileShader(shader);
        if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
            throw new Error(`a shader does not compile here: ${gl.getShaderInfoLog(shader)}`);
        }
        gl.attachShader(handle, shader);
    }
    gl.linkProgram(handle);
    if (!gl.getProgramParameter(handle, gl.LINK_STATUS)) {
        throw new Error(`shaders do not fit here: ${gl.getProgramInfoLog(handle)}`);
    }
    const uniforms = new Map();
    let unit = 0;
    for (let i = 0; i < gl.getProgramParameter(handle, gl.ACTIVE_UNIFORMS); i++) {
        const info = /** @type {WebGLActiveInfo} */ (gl.getActiveUniform(handle, i));
        const isTexture = info.type === gl.SAMPLER_2D || info.type === gl.UNSIGNED_INT_SAMPLER_2D;
        const place = gl.getUniformLocation(handle, info.name);
        uniforms.set(info.name, { place, type: info.type, unit: isTexture ? unit : -1 });
        if (isTexture) {
            gl.useProgram(handle);
            gl.uniform1i(place, unit);
            unit += 1;
        }
    }
    return { handle, uniforms };
}

/**
 * Sets those uniforms that a program has.
 * @param {WebGL2RenderingContext} gl
 * @param {Program} program
 * @param {Record<string, any>} values
 */
function set(gl, program, values) {
    for (const [name, texture] of Object.entries(values.textures ?? {})) {
        const uniform = program.uniforms.get(name);
        if (!uniform) continue;
        gl.activeTexture(gl.TEXTURE0 + uniform.unit);
        gl.bindTexture(gl.TEXTURE_2D, texture);
    }
    gl.activeTexture(gl.TEXTURE0 + 15);
    for (const [name, value] of Object.entries(values)) {
        const uniform = program.uniforms.get(name);
        if (!uniform) continue;
        const { place, type } = uniform;
        if (type === gl.FLOAT) gl.uniform1f(place, value);
        else if (type === gl.FLOAT_VEC2) gl.uniform2fv(place, value);
        else if (type === gl.FLOAT_VEC3) gl.uniform3fv(place, value);
        else if (type === gl.FLOAT_VEC4) gl.uniform4fv(place, value);
        else if (type === gl.BOOL_VEC4) gl.uniform4iv(place, value);
        else if (type === gl.FLOAT_MAT3) gl.uniformMatrix3fv(place, false, value);
        else if (type === gl.FLOAT_MAT4) gl.uniformMatrix4fv(place, false, value);
        else gl.uniform1i(place, value);
    }
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {number} width
 * @param {number} height
 * @param {number[]} formats
 * @param {boolean} withDepth
 * @returns {Target}
 */
function target(gl, width, height, formats, withDepth) {
    const framebuffer = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    const textures = formats.map((format, k) => {
        const texture = gl.createTexture();
        gl.bindTexture(gl.TEXTURE_2D, texture);
        gl.texStorage2D(gl.TEXTURE_2D, 1, format, width, height);
        const kind = format === gl.RGBA16F ? gl.LINEAR : gl.NEAREST;
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, kind);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, kind);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
        gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, texture, 0);
        return texture;
    });
    gl.drawBuffers(formats.map((_, k) => gl.COLOR_ATTACHMENT0 + k));
    let depth = null;
    if (withDepth) {
        depth = gl.createRenderbuffer();
        gl.bindRenderbuffer(gl.RENDERBUFFER, depth);
        gl.renderbufferStorage(gl.RENDERBUFFER, gl.DEPTH_COMPONENT24, width, height);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.RENDERBUFFER, depth);
    }
    return { framebuffer, textures, depth };
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {Target} target
 */
function free(gl, { framebuffer, textures, depth }) {
    gl.deleteFramebuffer(framebuffer);
    textures.forEach((texture) => gl.deleteTexture(texture));
    gl.deleteRenderbuffer(depth);
}

/**
 * @param {WebGL2RenderingContext} gl
 * @param {number[]} color
 */
function pixel(gl, color) {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, 1, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(color));
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return texture;
}

/**
 * Numbers that fill [0, 1) evenly, the first of them ½ so that a single frame looks through the middle.
 * @param {number} index
 * @param {number} base
 */
function halton(index, base) {
    if (index === 0) return 0.5;
    let [result, share] = [0, 1];
    for (let i = index; i > 0; i = Math.floor(i / base)) {
        share /= base;
        result += share * (i % base);
    }
    return result;
}
