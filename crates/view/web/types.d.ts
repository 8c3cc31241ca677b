/**
 * What the modules of the page hand to one another; types only, nothing of this is served.
 * Lengths are in the scene's unit, angles in radians, and page coordinates are scene coordinates less `Walk.centre`, so that
 * single precision suffices wherever in the world a scene lies.
 */

export type Vec3 = [number, number, number];

/** Whence one looks. `forward` and `up` are unit vectors; `fov` is the vertical field of view of a landscape picture. */
export interface Pose {
    eye: Vec3;
    forward: Vec3;
    up: Vec3;
    fov: number;
}

export interface NamedPose extends Pose {
    name: string;
    /** What the scene's camera is, where that is no perspective. */
    projection?: string;
}

/** A scene as `walk.js` decodes it: what the page has to know of it besides geometry and light, which are the renderer's. */
export interface Walk {
    name: string;
    up: Vec3;
    centre: Vec3;
    radius: number;
    bounds: [Vec3, Vec3];
    cameras: NamedPose[];
    /** Which camera one starts from, or a pose of its own. */
    home: number | Pose;
    /** What illuminance is told in, and by how much luminance-weighted irradiance is multiplied to get there. */
    unit: { name: "lx" | "W/m²"; factor: number };
    /** Whether a solver stands behind this page; `false` in an exported file. */
    live: boolean;
    base: string;
    materials: { name: string }[];
    stats: { triangles: number; cells: number; rays: number; error: number };
    generator: string;
    /** Surfaces, materials and pictures, for the renderer. */
    scene: Container;
    /** The light of an exported walk. */
    light: Container | null;
}

/** A header and the arrays that it names, as `walk.js` reads them. */
export interface Container {
    header: Record<string, any>;
    arrays: Record<string, Uint8Array | Int8Array | Int16Array | Uint16Array | Uint32Array | Float32Array>;
}

export type Curve = "agx" | "aces" | "reinhard" | "none";

export interface Options {
    /** In stops, a larger one is a brighter picture; `null` follows what is seen. */
    exposure: number | null;
    curve: Curve;
    falseColour: boolean;
    /** Least and greatest illuminance of the colour map, in `Walk.unit`; `null` follows what is seen. */
    range: [number, number] | null;
    logarithmic: boolean;
    cells: boolean;
    /** The colour map, `[256, 4]`, sRGB. */
    colours: Uint8Array;
}

export type Mode = "orbit" | "fly";
export type MapName = "turbo" | "viridis";

/** Everything a visitor can set: the renderer's options, less the table of colours, and what only the page knows. */
export interface Values extends Omit<Options, "colours"> {
    map: MapName;
    mode: Mode;
    /** Multiplies the speed of flight. */
    speed: number;
    picking: boolean;
}

/** What is seen at one place of the picture. Illuminance is in `Walk.unit`, radiance towards the eye as the solver has it. */
export interface Pick {
    point: Vec3;
    normal: Vec3;
    distance: number;
    irradiance: Vec3;
    illuminance: number;
    /** Relative, one standard deviation; NaN where it is not known. */
    error: number;
    radiance: Vec3;
    material: string;
    cell: number;
}

export interface FrameInfo {
    exposure: number;
    samples: number;
    illuminanceRange: [number, number];
}

/** How far a solve is. `error` is relative, or NaN while it is not known. */
export interface Status {
    state: "solving" | "paused" | "finished" | "lost";
    rays: number;
    rate: number;
    error: number;
    seconds: number;
    goal: { rays: number } | { error: number } | { seconds: number } | null;
    message?: string;
}

/** What `renderer.js` exports as `Renderer`. */
export interface RendererLike {
    setView(view: Pose): void;
    setOptions(options: Partial<Options>): void;
    readonly options: Options;
    readonly exposure: number;
    setLight(light: Container): void;
    pick(x: number, y: number): Promise<Pick | null>;
    screenshot(): Promise<Blob>;
    resize(): void;
    onframe: ((info: FrameInfo) => void) | null;
    /** Called where the graphics processor was taken away; the page loads again once it is back. */
    onlost: (() => void) | null;
    dispose(): void;
}

/** What `live.js` exports as `Live`. */
export interface LiveLike {
    pause(): Promise<void>;
    resume(): Promise<void>;
    close(): void;
}
