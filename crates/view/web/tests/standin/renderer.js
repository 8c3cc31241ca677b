/**
 * Draws the stand-in's room by casting a ray for every pixel, and answers picks the same way: enough of a picture to see that
 * controls do what they say. It draws one frame after a change and then rests.
 */

import { colourTable } from "twinray/colours.js";
import { BOXES } from "twinray/walk.js";

/** @import { FrameInfo, Options, Pick, Pose, Vec3, Walk } from "twinray/types.js" */

const VERTEX = `#version 300 es
void main() { gl_Position = vec4(vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;

const FRAGMENT = `#version 300 es
precision highp float;
const int N = ${BOXES.length};
uniform vec3 low[N], high[N], colour[N], eye, forward, up;
uniform vec2 size, range;
uniform float tangent, gain;
uniform bvec3 flags;
uniform sampler2D colours;
out vec4 pixel;
const vec3 lamp = vec3(0.0, 1.3, 0.3);
void main() {
    vec2 place = (2.0 * gl_FragCoord.xy - size) / size.y * tangent;
    vec3 way = normalize(forward + place.x * cross(forward, up) + place.y * up);
    float nearest = 1e9; vec3 normal = vec3(0), albedo = vec3(0);
    for (int i = 0; i < N; i++) {
        vec3 a = (low[i] - eye) / way, b = (high[i] - eye) / way, n = min(a, b), f = max(a, b);
        float t0 = max(max(n.x, n.y), n.z), t1 = min(min(f.x, f.y), f.z);
        if (t0 > t1) continue;
        bool within = t0 < 0.0; float t = within ? t1 : t0;
        if (t <= 0.0 || t >= nearest || (i > 0 && within)) continue;
        if (i == 0 && !within) t = t1;
        nearest = t; albedo = colour[i];
        vec3 s = i == 0 ? vec3(equal(f, vec3(t))) : vec3(equal(n, vec3(t)));
        normal = -sign(way) * s;
    }
    vec3 point = eye + nearest * way;
    if (nearest > 1e8) { pixel = vec4(0.03, 0.03, 0.035, 1); return; }
    vec3 to = lamp - point; float d2 = dot(to, to);
    float lux = 60.0 + 900.0 * max(dot(normal, to) / sqrt(d2), 0.0) / (d2 + 0.3);
    vec3 rgb;
    if (flags.x) {
        float t = flags.y ? log(lux / range.x) / log(range.y / range.x) : (lux - range.x) / (range.y - range.x);
        rgb = texture(colours, vec2(clamp(t, 0.002, 0.998), 0.5)).rgb;
    } else rgb = pow(1.0 - exp(-albedo * lux * gain), vec3(0.4545));
    vec3 g = abs(fract(point * 2.0 + 0.013) - 0.5);
    if (flags.z && any(greaterThan(g * (1.0 - abs(normal)), vec3(0.48)))) rgb *= 0.6;
    pixel = vec4(rgb, 1);
}`;

/** @param {Vec3} point @param {Vec3} normal */
function lux(point, normal) {
    const to = [0 - point[0], 1.3 - point[1], 0.3 - point[2]];
    const d2 = to[0] ** 2 + to[1] ** 2 + to[2] ** 2;
    const cosine = (normal[0] * to[0] + normal[1] * to[1] + normal[2] * to[2]) / Math.sqrt(d2);
    return 60 + (900 * Math.max(cosine, 0)) / (d2 + 0.3);
}

export class Renderer {
    /** @type {Options} */
    options = {
        exposure: null,
        curve: "agx",
        falseColour: false,
        range: null,
        logarithmic: true,
        cells: false,
        colours: colourTable("turbo"),
    };
    /** @type {((info: FrameInfo) => void) | null} */
    onframe = null;
    /** @type {(() => void) | null} */
    onlost = null;
    /** For tests: how often it drew. */
    frames = 0;
    #canvas;
    #gl;
    #program;
    /** @type {Pose} */
    #view = { eye: [0, 0, 0], forward: [0, 0, -1], up: [0, 1, 0], fov: 1 };
    #dirty = false;

    /** @param {HTMLCanvasElement} canvas @param {Walk} _walk */
    constructor(canvas, _walk) {
        this.#canvas = canvas;
        const gl = canvas.getContext("webgl2", { preserveDrawingBuffer: true });
        if (!gl) throw new Error("This browser has no WebGL 2, which the view needs.");
        this.#gl = gl;
        const program = /** @type {WebGLProgram} */ (gl.createProgram());
        for (const [type, source] of /** @type {[number, string][]} */ ([
            [gl.VERTEX_SHADER, VERTEX],
            [gl.FRAGMENT_SHADER, FRAGMENT],
        ])) {
            const shader = /** @type {WebGLShader} */ (gl.createShader(type));
            gl.shaderSource(shader, source);
            gl.compileShader(shader);
            if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader) ?? "");
            gl.attachShader(program, shader);
        }
        gl.linkProgram(program);
        gl.useProgram(program);
        this.#program = program;
        gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
        gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
        for (const name of /** @type {const} */ (["low", "high", "colour"])) {
            gl.uniform3fv(
                this.#at(name),
                BOXES.flatMap((box) => box[name]),
            );
        }
        this.resize();
    }

    /** @param {string} name */
    #at(name) {
        return this.#gl.getUniformLocation(this.#program, name);
    }

    get exposure() {
        return this.options.exposure ?? -7.4;
    }

    /** @param {Pose} view */
    setView(view) {
        this.#view = view;
        this.#draw();
    }

    /** @param {Partial<Options>} options */
    setOptions(options) {
        this.options = { ...this.options, ...options };
        this.#draw();
    }

    setLight() {
        this.#draw();
    }

    resize() {
        const { clientWidth, clientHeight } = this.#canvas;
        this.#canvas.width = Math.max(1, Math.round(clientWidth * devicePixelRatio));
        this.#canvas.height = Math.max(1, Math.round(clientHeight * devicePixelRatio));
        this.#draw();
    }

    #draw() {
        if (this.#dirty) return;
        this.#dirty = true;
        requestAnimationFrame(() => {
            this.#dirty = false;
            this.#frame();
            this.onframe?.({ exposure: this.exposure, samples: 1, illuminanceRange: [60, 870] });
        });
    }

    #frame() {
        const gl = this.#gl;
        const { eye, forward, up, fov } = this.#view;
        const { falseColour, logarithmic, cells, range, colours } = this.options;
        this.frames++;
        gl.viewport(0, 0, this.#canvas.width, this.#canvas.height);
        gl.uniform3fv(this.#at("eye"), eye);
        gl.uniform3fv(this.#at("forward"), forward);
        gl.uniform3fv(this.#at("up"), up);
        gl.uniform2f(this.#at("size"), this.#canvas.width, this.#canvas.height);
        gl.uniform2fv(this.#at("range"), range ?? [60, 870]);
        gl.uniform1f(this.#at("tangent"), Math.tan(fov / 2));
        gl.uniform1f(this.#at("gain"), 2 ** this.exposure);
        gl.uniform3i(this.#at("flags"), Number(falseColour), Number(logarithmic), Number(cells));
        gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, 256, 1, 0, gl.RGBA, gl.UNSIGNED_BYTE, colours);
        gl.drawArrays(gl.TRIANGLES, 0, 3);
    }

    /** @param {number} x @param {number} y @returns {Promise<Pick | null>} */
    async pick(x, y) {
        const { eye, forward: f, up: u, fov } = this.#view;
        const [width, height] = [this.#canvas.clientWidth, this.#canvas.clientHeight];
        const tangent = Math.tan(fov / 2);
        const [sx, sy] = [((2 * x - width) / height) * tangent, (1 - (2 * y) / height) * tangent];
        const right = [f[1] * u[2] - f[2] * u[1], f[2] * u[0] - f[0] * u[2], f[0] * u[1] - f[1] * u[0]];
        const way = f.map((c, i) => c + sx * right[i] + sy * u[i]);
        const norm = Math.hypot(...way);
        let [distance, cell, axis] = [Infinity, -1, 0];
        BOXES.forEach(({ low, high }, box) => {
            const near = way.map((c, i) => Math.min((low[i] - eye[i]) / c, (high[i] - eye[i]) / c));
            const far = way.map((c, i) => Math.max((low[i] - eye[i]) / c, (high[i] - eye[i]) / c));
            const [t0, t1] = [Math.max(...near), Math.min(...far)];
            if (t0 > t1) return;
            const t = box === 0 ? t1 : t0;
            if (t <= 0 || t >= distance) return;
            [distance, cell] = [t, box];
            axis = (box === 0 ? far : near).indexOf(t);
        });
        if (cell < 0) return null;
        const point = /** @type {Vec3} */ (eye.map((c, i) => c + way[i] * distance));
        const normal = /** @type {Vec3} */ ([0, 1, 2].map((i) => (i === axis ? -Math.sign(way[i]) : 0)));
        const { material, colour } = BOXES[cell];
        const illuminance = lux(point, normal);
        const irradiance = /** @type {Vec3} */ ([1, 1, 1].map(() => illuminance / 179));
        const radiance = /** @type {Vec3} */ (colour.map((c, i) => (c * irradiance[i]) / Math.PI));
        const found = {
            point,
            normal,
            distance: distance * norm,
            irradiance,
            illuminance,
            error: 0.021,
            radiance,
            material,
            cell,
        };
        return found;
    }

    /** @returns {Promise<Blob>} */
    screenshot() {
        this.#frame();
        return new Promise((resolve, reject) =>
            this.#canvas.toBlob((blob) => (blob ? resolve(blob) : reject(new Error("no picture")))),
        );
    }

    dispose() {}
}
