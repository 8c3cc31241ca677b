/**
 * Where one stands and how one moves: pure functions from pose to pose, and the camera that holds the current one.
 * No event and no element is known here; `controls.js` turns gestures into these calls. World up is +Y.
 */

import { add, along, dot, length, mix, normalize, scale, sub } from "twinray/vec.js";

/** @import { Pose, Vec3 } from "twinray/types.js" */
/** @import { Ticker } from "twinray/ticker.js" */
/** @typedef {{ yaw: number, pitch: number, roll: number }} Angles */
/** @typedef {{ forward: Vec3, up: Vec3, right: Vec3 }} Frame */

export const MIN_FOV = (10 * Math.PI) / 180;
export const MAX_FOV = (120 * Math.PI) / 180;
/** Wider than this, a portrait window would show little but its distorted edges. */
const MAX_VIEW_FOV = (130 * Math.PI) / 180;
const TRANSITION_SECONDS = 0.6;
/** How near the target may come and how far it may go, in radii of the scene: enough to see a screw, and to find back home. */
const NEAREST = 0.002;
const FARTHEST = 20;

/** @type {(x: number, low: number, high: number) => number} */
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);

/**
 * A level frame turned by `roll`. Yaw 0 looks along −Z and grows to the right; looking straight up or down is a direction like
 * any other, which a frame made with a cross product of world up is not.
 * @param {Angles} angles
 * @returns {Frame}
 */
export function frameOf({ yaw, pitch, roll }) {
    const [sy, cy, sp, cp] = [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)];
    /** @type {Vec3} */
    const forward = [sy * cp, sp, -cy * cp];
    /** @type {Vec3} */
    const level = [-sy * sp, cp, cy * sp];
    /** @type {Vec3} */
    const side = [cy, 0, sy];
    return {
        forward,
        up: along(scale(level, Math.cos(roll)), side, Math.sin(roll)),
        right: along(scale(side, Math.cos(roll)), level, -Math.sin(roll)),
    };
}

/**
 * The angles that `frameOf` turns into this pose's frame.
 * @param {Pick<Pose, "forward" | "up">} pose
 * @returns {Angles}
 */
export function anglesOf({ forward, up }) {
    const [x, y, z] = normalize(forward);
    const pitch = Math.asin(clamp(y, -1, 1));
    if (Math.hypot(x, z) < 1e-5) {
        // Straight up or down only `up` tells where one would look when raising one's head.
        return { yaw: y < 0 ? Math.atan2(up[0], -up[2]) : Math.atan2(-up[0], up[2]), pitch, roll: 0 };
    }
    const yaw = Math.atan2(x, -z);
    const level = frameOf({ yaw, pitch, roll: 0 });
    const roll = Math.atan2(dot(up, level.right), dot(up, level.up));
    // The rest of a cross product is no tilt of the head; a horizon that is level shall stay so to the bit.
    return { yaw, pitch, roll: Math.abs(roll) < 1e-6 ? 0 : roll };
}

/** @param {Pose} pose @returns {Frame} */
export const frameOfPose = (pose) => frameOf(anglesOf(pose));

/** @param {Pose} pose @param {Angles} angles @returns {Pose} */
function turned(pose, angles) {
    const { forward, up } = frameOf(angles);
    return { ...pose, forward, up };
}

/**
 * Turns the head, in radians to the right and up.
 * @type {(pose: Pose, right: number, up: number) => Pose}
 */
export function look(pose, right, up) {
    const { yaw, pitch, roll } = anglesOf(pose);
    return turned(pose, { yaw: yaw + right, pitch: clamp(pitch + up, -Math.PI / 2, Math.PI / 2), roll });
}

/**
 * Turns around the point `distance` ahead, which stays where it is in the picture.
 * @type {(pose: Pose, distance: number, right: number, up: number) => Pose}
 */
export function orbit(pose, distance, right, up) {
    const next = look(pose, right, up);
    return { ...next, eye: along(along(pose.eye, pose.forward, distance), next.forward, -distance) };
}

/**
 * Moves by a vector in the camera's frame: right, world up, and forward.
 * @type {(pose: Pose, step: Vec3) => Pose}
 */
export function move(pose, [right, up, forward]) {
    const frame = frameOfPose(pose);
    const eye = along(along(pose.eye, frame.right, right), frame.forward, forward);
    return { ...pose, eye: add(eye, [0, up, 0]) };
}

/**
 * Moves within the plane of the picture.
 * @type {(pose: Pose, right: number, up: number) => Pose}
 */
export function pan(pose, right, up) {
    const frame = frameOfPose(pose);
    return { ...pose, eye: along(along(pose.eye, frame.right, right), frame.up, up) };
}

/**
 * Moves along the line to `point` until its distance is `factor` times what it was: the point stays where it is in the picture.
 * @type {(pose: Pose, point: Vec3, factor: number) => Pose}
 */
export const dolly = (pose, point, factor) => ({ ...pose, eye: mix(point, pose.eye, factor) });

/**
 * The pose that has `point` in its middle, `distance` away, seen from the side from which `pose` sees it.
 * @type {(pose: Pose, point: Vec3, distance: number) => Pose}
 */
export function focused(pose, point, distance) {
    const to = sub(point, pose.eye);
    const forward = length(to) > 0 ? normalize(to) : pose.forward;
    const { yaw, pitch } = anglesOf({ forward, up: pose.up });
    const { roll } = anglesOf(pose);
    return { ...turned(pose, { yaw, pitch, roll }), eye: along(point, forward, -distance) };
}

/**
 * A pose between two, `t` from 0 to 1, along the shorter turn and with the horizon as level as theirs.
 * @type {(from: Pose, to: Pose, t: number) => Pose}
 */
export function between(from, to, t) {
    const [a, b] = [anglesOf(from), anglesOf(to)];
    /** @type {(x: number, y: number) => number} */
    const turn = (x, y) => x + Math.atan2(Math.sin(y - x), Math.cos(y - x)) * t;
    const angles = { yaw: turn(a.yaw, b.yaw), pitch: a.pitch + (b.pitch - a.pitch) * t, roll: turn(a.roll, b.roll) };
    return turned({ ...from, eye: mix(from.eye, to.eye, t), fov: from.fov + (to.fov - from.fov) * t }, angles);
}

/**
 * The pose that sees a whole scene from outside, from its south-east and a little above.
 * @type {(radius: number) => Pose}
 */
export function overview(radius) {
    const fov = Math.PI / 4;
    const { forward, up } = frameOf({ yaw: -Math.PI / 6, pitch: -Math.PI / 7, roll: 0 });
    return { eye: scale(forward, (-1.05 * radius) / Math.sin(fov / 2)), forward, up, fov };
}

/** Slow at both ends. @param {number} t */
export const ease = (t) => t * t * (3 - 2 * t);

/**
 * The vertical field of view that a window of this aspect ratio gets. In an upright one, as a telephone's, the field of view
 * is that of its width: otherwise a room seen there would be a slit of it.
 * @type {(fov: number, aspect: number) => number}
 */
export function viewFov(fov, aspect) {
    if (aspect >= 1) return fov;
    return Math.max(fov, Math.min(2 * Math.atan(Math.tan(fov / 2) / aspect), MAX_VIEW_FOV));
}

/**
 * Whether two poses give the same picture, as far as anyone can see.
 * @type {(a: Pose, b: Pose, radius: number) => boolean}
 */
export function samePose(a, b, radius) {
    return (
        length(sub(a.eye, b.eye)) < 1e-4 * radius &&
        dot(a.forward, b.forward) > 1 - 1e-7 &&
        dot(a.up, b.up) > 1 - 1e-5 &&
        Math.abs(a.fov - b.fov) < 1e-3
    );
}

/** The current pose, the distance of what it turns around, and transitions to another. */
export class Camera {
    /** Width over height of the picture. */
    aspect = 1;
    /** Called after every change. @type {() => void} */
    onchange = () => {};
    /** Called where a transition ends. @type {() => void} */
    onarrive = () => {};
    #ticker;
    #radius;
    #pose;
    #distance;
    /** @type {import("twinray/ticker.js").Task | null} */
    #transition = null;
    /** Where a running transition ends. @type {Pose | null} */
    #goal = null;

    /**
     * @param {Pose} pose
     * @param {number} distance of the point that orbits go around
     * @param {number} radius of the scene
     * @param {Ticker} ticker
     */
    constructor(pose, distance, radius, ticker) {
        this.#pose = pose;
        this.#radius = radius;
        this.#ticker = ticker;
        this.#distance = this.#allowed(distance);
    }

    get pose() {
        return this.#pose;
    }

    get distance() {
        return this.#distance;
    }

    /** The point that orbits go around, in page coordinates. */
    get target() {
        return along(this.#pose.eye, this.#pose.forward, this.#distance);
    }

    /** Where the camera is going, or is. */
    get destination() {
        return this.#goal ?? this.#pose;
    }

    get moving() {
        return this.#transition !== null;
    }

    /** The pose with the vertical field of view of this window. @returns {Pose} */
    get view() {
        return { ...this.#pose, fov: viewFov(this.#pose.fov, this.aspect) };
    }

    /**
     * The unit direction through a place of the picture, from −1 to 1 to the right and up.
     * @type {(x: number, y: number) => Vec3}
     */
    ray(x, y) {
        const { forward, right, up } = frameOfPose(this.#pose);
        const tan = Math.tan(this.view.fov / 2);
        return normalize(along(along(forward, right, x * tan * this.aspect), up, y * tan));
    }

    /**
     * Where in the picture a point is, from −1 to 1 to the right and up; null behind the camera.
     * @type {(point: Vec3) => [number, number] | null}
     */
    project(point) {
        const { forward, right, up } = frameOfPose(this.#pose);
        const to = sub(point, this.#pose.eye);
        const depth = dot(to, forward);
        if (depth <= 0) return null;
        const tan = Math.tan(this.view.fov / 2) * depth;
        return [dot(to, right) / (tan * this.aspect), dot(to, up) / tan];
    }

    /** Sets the pose at once and ends a transition. @param {Pose} pose @param {number} [distance] */
    set(pose, distance = this.#distance) {
        this.stop();
        this.#pose = pose;
        this.#distance = this.#allowed(distance);
        this.onchange();
    }

    /** Goes to a pose, slowly where movement is welcome. @param {Pose} pose @param {number} [distance] */
    go(pose, distance = this.#distance) {
        this.stop();
        if (matchMedia("(prefers-reduced-motion: reduce)").matches) {
            this.set(pose, distance);
            return this.onarrive();
        }
        const [from, near, far] = [this.#pose, this.#distance, this.#allowed(distance)];
        let seconds = 0;
        this.#goal = pose;
        this.#transition = (step) => {
            seconds += step;
            const t = ease(Math.min(seconds / TRANSITION_SECONDS, 1));
            // The end is the very pose that was asked for, not one that went through angles and back.
            this.#pose = t < 1 ? between(from, pose, t) : pose;
            this.#distance = near + (far - near) * t;
            if (t === 1) this.#transition = this.#goal = null;
            this.onchange();
            if (t === 1) this.onarrive();
            return t < 1;
        };
        this.#ticker.add(this.#transition);
    }

    /** Ends a transition where it is. */
    stop() {
        if (this.#transition) this.#ticker.remove(this.#transition);
        this.#transition = this.#goal = null;
    }

    /** @param {number} right @param {number} up */
    look(right, up) {
        this.set(look(this.#pose, right, up));
    }

    /** @param {number} right @param {number} up */
    orbit(right, up) {
        this.set(orbit(this.#pose, this.#distance, right, up));
    }

    /** @param {Vec3} step */
    move(step) {
        this.set(move(this.#pose, step));
    }

    /** Moves so that what is at the target's distance follows a pointer; shares of the picture's height. @param {number} right @param {number} up */
    pan(right, up) {
        const height = 2 * Math.tan(this.view.fov / 2) * this.#distance;
        this.set(pan(this.#pose, -right * height, -up * height));
    }

    /** Comes `factor` as near to a point, which becomes the depth that orbits go around. @param {Vec3} point @param {number} factor */
    dolly(point, factor) {
        const depth = dot(sub(point, this.#pose.eye), this.#pose.forward);
        if (!(depth > 0)) return;
        // At the limit one stays: a correction that pushed back and let come again would creep through what is there.
        const next = this.#allowed(depth * factor);
        if (factor < 1 === next >= depth) return;
        this.set(dolly(this.#pose, point, next / depth), next);
    }

    /** Says how far away that is around which to turn; the picture stays as it is. @param {number} distance */
    aim(distance) {
        this.#distance = this.#allowed(distance);
    }

    /** Looks at a point from nearer by. @param {Vec3} point */
    focus(point) {
        const distance = this.#allowed(0.6 * length(sub(point, this.#pose.eye)));
        this.go(focused(this.#pose, point, distance), distance);
    }

    /** @param {number} fov in radians */
    setFov(fov) {
        this.set({ ...this.#pose, fov: clamp(fov, MIN_FOV, MAX_FOV) });
    }

    /** @param {number} distance */
    #allowed(distance) {
        return clamp(distance, NEAREST * this.#radius, FARTHEST * this.#radius) || this.#radius;
    }
}
