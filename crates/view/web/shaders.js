// What runs on the graphics processor: the paper's representation of light, per fragment; tone curves.

import { MATERIAL_TEXELS, ROW } from "twinray/resources.js";

const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;
`;

/** Unit vectors from two numbers: octahedral of crates/view/src/packed.rs. */
const OCTAHEDRON = `vec3 fromOctahedron(vec2 p) {
    vec3 n = vec3(p, 1.0 - abs(p.x) - abs(p.y));
    float t = max(-n.z, 0.0);
    n.x += n.x >= 0.0 ? -t : t;
    n.y += n.y >= 0.0 ? -t : t;
    return normalize(n);
}
`;

/** Vertices come one a corner, so that three in a row are a triangle and their numbers its number. */
export const SURFACE_VERTEX = `${HEAD}
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 normal;
layout(location = 2) in vec4 texcoords;
uniform mat4 uViewProjection;
flat out uint vTriangle;
out vec2 vPlace;
out vec3 vPoint;
out vec3 vNormal;
out vec4 vTexcoords;
${OCTAHEDRON}void main() {
    vTriangle = uint(gl_VertexID / 3);
    int corner = gl_VertexID % 3;
    vPlace = vec2(corner == 1 ? 1.0 : 0.0, corner == 2 ? 1.0 : 0.0);
    vPoint = position;
    vNormal = fromOctahedron(normal);
    vTexcoords = texcoords;
    gl_Position = uViewProjection * vec4(position, 1.0);
}`;

/** Pieces of triangles, which say themselves whose they are: see-through.js. */
export const PIECE_VERTEX = `${HEAD}
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec4 texcoords;
layout(location = 3) in vec2 place;
layout(location = 4) in uint triangle;
uniform mat4 uViewProjection;
flat out uint vTriangle;
out vec2 vPlace;
out vec3 vPoint;
out vec3 vNormal;
out vec4 vTexcoords;
void main() {
    vTriangle = triangle;
    vPlace = place;
    vPoint = position;
    vNormal = normal;
    vTexcoords = texcoords;
    gl_Position = uViewProjection * vec4(position, 1.0);
}`;

/** A triangle over the whole film. */
export const FILM_VERTEX = `${HEAD}
out vec2 vFilm;
void main() {
    vec2 p = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
    vFilm = 0.5 * p + 0.5;
    gl_Position = vec4(p, 1.0, 1.0);
}`;

/** Where slots lie on a triangle, and which surround a place: Lattice of crates/render/src/walk/nodes.rs. */
const LATTICE = `
const uint NONE = 0xffffffffu;
uniform usampler2D uTriangles;
ivec2 at(int index) { return ivec2(index % ${ROW}, index / ${ROW}); }
float heightAt(float x, float foot) {
    return clamp(x < foot || foot == 1.0 ? x / max(foot, 1e-9) : (1.0 - x) / (1.0 - foot), 0.0, 1.0);
}
float areaLeftOf(float x, float foot) {
    return x < foot ? x * x / foot : 1.0 - (1.0 - x) * (1.0 - x) / max(1.0 - foot, 1e-9);
}
struct Around { ivec4 slots; vec4 weights; vec2 lattice; bool strips; };
/* Place along the longest side, share of the height there. */
vec2 inStrips(uvec4 record, vec2 place, float foot) {
    vec3 w = vec3(1.0 - place.x - place.y, place);
    int first = int(record.x & 3u);
    float b = w[(first + 1) % 3], c = w[(first + 2) % 3];
    float x = clamp(b + c * foot, 0.0, 1.0);
    float h = heightAt(x, foot);
    return vec2(x, h > 0.0 ? clamp(c / h, 0.0, 1.0) : 0.0);
}
Around slotsAround(uvec4 record, uvec4 more, vec2 place) {
    if ((record.x & 0x80000000u) != 0u) {
        float foot = float((record.x >> 2) & 0xffffu) / 65535.0;
        int columns = int(more.z), rows = int(more.w);
        vec2 p = inStrips(record, place, foot) * vec2(columns, rows);
        ivec2 k = clamp(ivec2(p), ivec2(0), ivec2(columns - 1, rows - 1));
        vec2 f = clamp(p - vec2(k), 0.0, 1.0);
        int s = k.x * (rows + 1) + k.y;
        vec4 w = vec4((1.0 - f.x) * (1.0 - f.y), (1.0 - f.x) * f.y, f.x * (1.0 - f.y), f.x * f.y);
        return Around(ivec4(s, s + 1, s + rows + 1, s + rows + 2), w, p, true);
    }
    int m = int(record.x);
    vec2 p = max(place, 0.0) * float(m);
    int j = min(int(p.y), m - 1);
    int i = min(int(p.x), m - 1 - j);
    vec2 f = p - vec2(i, j);
    int low = j * (m + 1) - j * (j - 1) / 2 + i, high = low + m + 1 - j;
    if (f.x + f.y <= 1.0 || i + j + 1 >= m) {
        return Around(ivec4(low, low + 1, high, low), vec4(1.0 - f.x - f.y, f, 0.0), p, false);
    }
    return Around(ivec4(high + 1, high, low + 1, low), vec4(f.x + f.y - 1.0, 1.0 - f.x, 1.0 - f.y, 0.0), p, false);
}
/* The cell at a place: Cells::locate of crates/scene/src/cells.rs. */
int cellAt(uvec4 record, uvec4 more, vec2 place) {
    if ((record.x & 0x80000000u) != 0u) {
        float foot = float((record.x >> 2) & 0xffffu) / 65535.0;
        int columns = int(more.z), rows = int(more.w);
        vec2 p = inStrips(record, place, foot);
        int column = min(int(areaLeftOf(p.x, foot) * float(columns)), columns - 1);
        return column * rows + min(int(p.y * float(rows)), rows - 1);
    }
    int m = int(record.x);
    vec2 p = max(place, 0.0) * float(m);
    int j = min(int(p.y), m - 1);
    int i = min(int(p.x), m - 1 - j);
    bool upper = p.x - float(i) + p.y - float(j) > 1.0 && i + j + 1 < m;
    return j * (2 * m - j) + 2 * i + (upper ? 1 : 0);
}
`;

/**
 * Radiance times exposure, in two parts: what is known of all directions, and what one remembered sample a cell adds to
 * it, which is right only in the mean over solutions. Paper: §1, §2.1.
 */
export const SURFACE_FRAGMENT = `${HEAD}
${LATTICE}
flat in uint vTriangle;
in vec2 vPlace;
in vec3 vPoint;
in vec3 vNormal;
in vec4 vTexcoords;
uniform sampler2D uMaterials, uAlbedos, uIrradiance, uRadiance, uDirections;
uniform usampler2D uSamples, uLamps;
uniform float uLampScale;
uniform sampler2D uBase, uEmission, uMetal, uBumps;
uniform vec3 uEye;
uniform vec4 uScales; /* irradiance, radiance, samples, exposure */
uniform int uGlossySlots, uMode; /* 0 radiance, 1 illuminance */
uniform bool uCells, uSampled;
uniform bvec4 uHas; /* textures: base colour, emission, metalness and roughness, normals */
uniform vec3 uSeed;
uniform int uPass; /* 0 what covers, 1 what is blended by one share for all colours, 2 what passes of each colour, 3 what is added */
layout(location = 0) out vec4 oKnown;
layout(location = 1) out vec4 oSampled;

const float PI = 3.141592653589793;
const float BRIGHTEST = 12.0;
float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }
/* What half floats hold: one infinite or undefined fragment would stay in a mean for good. */
vec3 finite(vec3 c) { return any(isnan(c)) ? vec3(0.0) : clamp(c, -60000.0, 60000.0); }
float random(vec3 p) {
    uvec3 q = uvec3(floatBitsToUint(p.x), floatBitsToUint(p.y), floatBitsToUint(p.z)) * uvec3(1664525u, 22695477u, 1103515245u);
    uint h = q.x ^ q.y ^ q.z;
    h ^= h >> 16; h *= 0x7feb352du; h ^= h >> 15; h *= 0x846ca68bu; h ^= h >> 16;
    return float(h >> 8) / 16777216.0;
}
int materialStart;
vec4 material(int k) { return texelFetch(uMaterials, at(materialStart + k), 0); }
vec2 transformed(int k) {
    vec4 matrix = material(k), offset = material(k + 1);
    vec2 uv = offset.z > 0.5 ? vTexcoords.zw : vTexcoords.xy;
    return mat2(matrix.xy, matrix.zw) * uv + offset.xy;
}
${OCTAHEDRON}/* Normals of the map, by the derivatives of place and texture coordinates (Schüler, "Normal mapping without precomputed
   tangents", ShaderX 5, 2006). */
vec3 bumped(vec3 n, vec2 uv, float scale) {
    vec3 p1 = dFdx(vPoint), p2 = dFdy(vPoint);
    vec2 t1 = dFdx(uv), t2 = dFdy(uv);
    vec3 a = cross(p2, n), b = cross(n, p1);
    vec3 tangent = a * t1.x + b * t2.x, bitangent = a * t1.y + b * t2.y;
    float size = max(dot(tangent, tangent), dot(bitangent, bitangent));
    if (size <= 0.0) return n;
    vec3 map = texture(uBumps, uv).xyz * 2.0 - 1.0;
    float inverse = inversesqrt(size);
    return normalize(mat3(tangent * inverse, -bitangent * inverse, n) * vec3(map.xy * scale * vec2(1.0, -1.0), map.z));
}

struct Look { vec3 diffuse, f0; float f90, coat0, coat90, alpha, roughness, exponent; int kind; bool glossy; };

/* Factors on the reflectance at normal and grazing incidence; a white Phong lobe's albedo. */
vec3 split(Look l, float cosine) {
    return texture(uAlbedos, vec2((cosine * 31.0 + 0.5) / 33.0, (l.roughness * 31.0 + 0.5) / 32.0)).xyz;
}
vec3 lobeAlbedo(Look l, vec3 s) { return l.kind == 2 ? l.f0 * s.z : l.f0 * s.x + l.f90 * s.y; }

/* The lobe's part of the BRDF: GGX with height-correlated Smith, or normalised Phong. */
vec3 lobe(Look l, vec3 n, vec3 wi, vec3 wo) {
    float ci = dot(n, wi), co = dot(n, wo);
    if (ci <= 0.0 || co <= 0.0) return vec3(0.0);
    if (l.kind == 2) {
        float c = max(dot(reflect(-wi, n), wo), 0.0);
        return l.f0 * ((l.exponent + 2.0) / (2.0 * PI) * pow(c, l.exponent));
    }
    vec3 h = normalize(wi + wo);
    float a2 = l.alpha * l.alpha, nh = dot(n, h);
    float d = nh * nh * (a2 - 1.0) + 1.0;
    float smith = co * sqrt(a2 + (1.0 - a2) * ci * ci) + ci * sqrt(a2 + (1.0 - a2) * co * co);
    float fresnel = pow(1.0 - clamp(dot(wi, h), 0.0, 1.0), 5.0);
    return (l.f0 * (1.0 - fresnel) + vec3(l.f90 * fresnel)) * (a2 / (PI * d * d)) * (0.5 / smith);
}

vec3 unpacked(uint bits) { return vec3(bits & 511u, (bits >> 9) & 511u, (bits >> 18) & 511u) * exp2(float(bits >> 27) - 24.0); }

/* By what a lobe of this width shrinks harmonics of degree 1 and 2, and a window against their swinging: those of a Gaussian on the sphere of sharpness 2/α²
   of half vectors, whose mirror directions spread 2 cosθ times as far (Wang et al., SIGGRAPH Asia 2009). */
vec2 shrink(Look l, float co) {
    float sharp = l.kind == 2 ? max(l.exponent, 0.5) : 1.0 / (2.0 * l.alpha * l.alpha * max(co, 0.2));
    return vec2(0.92, 0.75) * exp(-vec2(2.0, 6.0) / (2.0 * sharp));
}

void main() {
    int triangle = int(vTriangle);
    uvec4 record = texelFetch(uTriangles, at(2 * triangle), 0), more = texelFetch(uTriangles, at(2 * triangle + 1), 0);
    materialStart = int(record.w) * ${MATERIAL_TEXELS};
    bool front = gl_FrontFacing;
    uint first = front ? record.y : record.z;
    vec4 base = material(0), glow = material(1), m2 = material(2), m3 = material(3), m4 = material(4);
    vec4 texel = uHas.x ? texture(uBase, transformed(6)) : vec4(1.0);
    vec3 color = base.rgb * texel.rgb;
    float alpha = base.a * texel.a;

    vec3 wo = normalize(uEye - vPoint);
    vec3 facet = normalize(cross(dFdx(vPoint), dFdy(vPoint)));
    facet = dot(facet, wo) < 0.0 ? -facet : facet;
    vec3 n = normalize(vNormal);
    n = dot(n, facet) < 0.0 ? -n : n;
    /* Holes, after what neighbouring fragments have to take part in. */
    if ((m4.x >= 0.0 && alpha < m4.x) || first == NONE) discard;

    /* Irradiance, smooth between the corners of cells. */
    Around around = slotsAround(record, more, vPlace);
    vec3 irradiance = vec3(0.0);
    for (int k = 0; k < 4; k++) {
        if (around.weights[k] != 0.0) irradiance += around.weights[k] * texelFetch(uIrradiance, at(int(first) + around.slots[k]), 0).rgb;
    }
    if (uCells) {
        irradiance = vec3(0.0);
        for (int k = 0; k < 3; k++) irradiance += texelFetch(uIrradiance, at(int(first) + around.slots[k]), 0).rgb / 3.0;
    }
    irradiance *= uScales.x;
    if (uMode == 1) {
        oKnown = vec4(vec3(luminance(irradiance) * uScales.w), 1.0);
        oSampled = vec4(0.0, 0.0, 0.0, 1.0);
        return;
    }

    vec3 metal = uHas.z ? texture(uMetal, transformed(10)).rgb : vec3(1.0);
    Look l;
    l.kind = int(glow.a);
    float metallic = clamp(m2.x * metal.b, 0.0, 1.0);
    l.roughness = clamp(m2.y * metal.g, 0.01, 1.0);
    l.alpha = l.roughness * l.roughness;
    l.exponent = m4.z;
    l.diffuse = color * (1.0 - metallic);
    l.glossy = l.kind != 0;
    if (l.kind == 1) {
        vec3 coat = clamp(m3.rgb * m2.w, 0.0, 1.0) * m2.z;
        l.f0 = mix(coat, color, metallic);
        l.f90 = m2.z + (1.0 - m2.z) * metallic;
        l.coat0 = max(coat.r, max(coat.g, coat.b));
        l.coat90 = m2.z;
    } else if (l.kind == 2) {
        l.f0 = material(5).rgb;
        l.roughness = sqrt(sqrt(2.0 / (l.exponent + 2.0)));
        l.alpha = l.roughness * l.roughness;
    }
    float passing = m3.a * (1.0 - metallic);
    float co = clamp(dot(facet, wo), 0.0, 1.0);
    vec3 s = l.glossy ? split(l, co) : vec3(0.0);
    float coatAlbedo = l.kind == 1 ? l.coat0 * s.x + l.coat90 * s.y : 0.0;
    /* What is seen through: the rest of the base. */
    vec3 through = passing * (1.0 - coatAlbedo) * color;
    if (m4.y > 0.5) through = mix(vec3(1.0), through, alpha);
    float cover = 1.0 - luminance(through);
    if (uPass == 2) {
        oKnown = oSampled = vec4(through, 1.0 - cover);
        return;
    }
    vec3 known = irradiance * l.diffuse * ((1.0 - coatAlbedo) * (1.0 - passing) / PI);
    vec3 sampled = vec3(0.0);

    if (l.glossy && int(first) < uGlossySlots) {
        if (uHas.w) n = bumped(n, transformed(12), m4.w);
        vec3 albedo = lobeAlbedo(l, s);
        vec3 r = reflect(-wo, n);
        vec2 k = shrink(l, co);
        /* Radiance from around the mirror direction. Few harmonics swing below zero beside what is bright; the kernel
           ((1 + cos)/2)² of degree 2 does not, and what it sees is never all dark. */
        vec3 y1 = 0.8462844 * vec3(r.y, r.z, r.x);
        vec3 y2a = 2.4430126 * vec3(r.x * r.y, r.y * r.z, 0.2886751 * (3.0 * r.z * r.z - 1.0));
        vec2 y2b = 2.4430126 * vec2(r.x * r.z, 0.5 * (r.x * r.x - r.y * r.y));
        vec3 radiance = vec3(0.0), lamps = vec3(0.0), towards = vec3(0.0);
        float spread = 0.0, total = 0.0;
        for (int c = 0; c < 4; c++) {
            if (around.weights[c] == 0.0) continue;
            int slot = int(first) + around.slots[c];
            vec3 even = texelFetch(uRadiance, at(slot), 0).rgb;
            vec4 b0 = texelFetch(uDirections, at(6 * slot), 0), b1 = texelFetch(uDirections, at(6 * slot + 1), 0);
            vec4 b2 = texelFetch(uDirections, at(6 * slot + 2), 0), b3 = texelFetch(uDirections, at(6 * slot + 3), 0);
            vec4 b4 = texelFetch(uDirections, at(6 * slot + 4), 0), b5 = texelFetch(uDirections, at(6 * slot + 5), 0);
            vec3 first3 = y1.x * b0.xyz + y1.y * vec3(b0.w, b1.xy) + y1.z * vec3(b1.zw, b2.x);
            vec3 last5 = y2a.x * b2.yzw + y2a.y * b3.xyz + y2a.z * vec3(b3.w, b4.xy) + y2b.x * vec3(b4.zw, b5.x) + y2b.y * b5.yzw;
            vec3 sharp = 0.2820948 + k.x * first3 + k.y * last5, blunt = 0.2820948 + 0.5 * first3 + 0.1 * last5;
            radiance += around.weights[c] * even * max(sharp, 0.3 * max(blunt, 0.0));
            uvec2 lamp = texelFetch(uLamps, at(slot), 0).xy;
            vec3 arriving = around.weights[c] * unpacked(lamp.x);
            float bright = luminance(arriving), s = float(lamp.y >> 24) / 255.0;
            lamps += arriving;
            towards += bright * fromOctahedron(vec2(lamp.y & 4095u, (lamp.y >> 12) & 4095u) / 2047.5 - 1.0);
            spread += bright * s * s;
            total += bright;
        }
        vec3 mirrored = albedo * radiance * uScales.y;
        if (total > 0.0) {
            /* Lamps as one direction, whose spread widens the lobe: 1 − R is 1/κ of directions about a mean, and α²/2 of a lobe's. */
            Look wide = l;
            wide.alpha = min(sqrt(l.alpha * l.alpha + 0.5 * spread / total), 1.0);
            wide.exponent = max(2.0 / (wide.alpha * wide.alpha) - 2.0, 0.0);
            vec3 d = normalize(towards);
            mirrored += lobe(wide, n, d, wo) * lamps * (max(dot(n, d), 0.0) * uLampScale);
        }
        known += mirrored;

        if (uSampled) {
            /* The remembered sample of a cell nearby, so that cells blend in the mean over frames. */
            vec3 seed = vec3(gl_FragCoord.xy, 0.0) + uSeed;
            vec2 jitter = vec2(random(seed), random(seed + 17.0)) - 0.5;
            bool strips = (record.x & 0x80000000u) != 0u;
            vec2 step = strips ? vec2(0.0) : vec2(1.5 / float(record.x));
            vec2 place = clamp(vPlace + jitter * step, 0.0, 1.0);
            if (place.x + place.y > 1.0) place = 1.0 - place.yx;
            uint cells = front ? more.x : more.y;
            uvec2 packed = texelFetch(uSamples, at(int(cells) + cellAt(record, more, place)), 0).xy;
            if (packed.x != 0u) {
                vec3 brought = unpacked(packed.x) * uScales.z;
                vec2 octahedral = vec2(int(packed.y << 16) >> 16, int(packed.y) >> 16) / 32767.0;
                vec3 wi = fromOctahedron(octahedral);
                /* What is shown is a mean of what is known and of samples: n of them count n to PRIOR of renderer.js. */
                sampled = brought * lobe(l, n, wi, wo) - mirrored;
            }
        }
    }
    bool lit = luminance(known) > 0.0;
    vec3 emitted = front ? glow.rgb * (uHas.y ? texture(uEmission, transformed(8)).rgb : vec3(1.0)) : vec3(0.0);
    bool emits = luminance(emitted) > 0.0;
    emitted *= uScales.w;
    emitted *= min(1.0, BRIGHTEST / max(max(emitted.r, emitted.g), max(emitted.b, 1e-20)));
    if (m4.y > 0.5) {
        known *= alpha;
        sampled *= alpha;
        emitted *= alpha;
    }
    if (uCells) {
        vec2 d = abs(fract(around.lattice) - 0.5), w = fwidth(around.lattice);
        float third = around.strips ? 0.0 : abs(fract(around.lattice.x + around.lattice.y) - 0.5);
        float line = max(max((d.x - 0.5) / max(w.x, 1e-6), (d.y - 0.5) / max(w.y, 1e-6)), around.strips ? -9.0 : (third - 0.5) / max(fwidth(around.lattice.x + around.lattice.y), 1e-6));
        float far = max(w.x, w.y);
        known *= mix(1.0, 0.55, clamp(1.0 + line, 0.0, 1.0) * (1.0 - smoothstep(0.3, 0.8, far)));
    }
    /* The second alpha says what automatic exposure looks at; where it is what blends, samples behind need all of it. */
    oKnown = vec4(finite(known * uScales.w + emitted), cover);
    oSampled = vec4(finite(sampled * uScales.w), uPass == 1 || (lit && !emits) ? cover : 0.0);
}`;

/** What lies behind everything. */
export const SKY_FRAGMENT = `${HEAD}
in vec2 vFilm;
uniform sampler2D uSky;
uniform mat3 uRay;
uniform vec2 uScale; /* radiance times exposure, 0 without a sky; 1 in false colour */
layout(location = 0) out vec4 oKnown;
layout(location = 1) out vec4 oSampled;
void main() {
    vec3 d = normalize(uRay * vec3(2.0 * vFilm - 1.0, 1.0));
    vec2 uv = vec2(atan(d.x, -d.z) / 6.283185307179586 + 0.5, acos(clamp(d.y, -1.0, 1.0)) / 3.141592653589793);
    vec3 c = textureLod(uSky, uv, 0.0).rgb * uScale.x;
    c *= min(1.0, 12.0 / max(max(c.r, c.g), max(c.b, 1e-20)));
    /* In false colour what is seen counts by its share of a pixel. */
    oKnown = uScale.y > 0.5 ? vec4(0.0) : vec4(c, 1.0);
    oSampled = vec4(0.0);
}`;

/** Which triangle is where: number + 1, place, side. */
export const PICK_FRAGMENT = `${HEAD}
${LATTICE}
flat in uint vTriangle;
in vec2 vPlace;
in vec4 vTexcoords;
uniform sampler2D uMaterials, uBase;
layout(location = 0) out uvec4 oPicked;
vec4 material(int k) { return texelFetch(uMaterials, at(int(texelFetch(uTriangles, at(2 * int(vTriangle)), 0).w) * ${MATERIAL_TEXELS} + k), 0); }
void main() {
    vec4 matrix = material(6), offset = material(7);
    vec2 uv = mat2(matrix.xy, matrix.zw) * (offset.z > 0.5 ? vTexcoords.zw : vTexcoords.xy) + offset.xy;
    float alpha = material(0).a * texture(uBase, uv).a;
    uvec4 record = texelFetch(uTriangles, at(2 * int(vTriangle)), 0);
    if ((material(4).x >= 0.0 && alpha < material(4).x) || (gl_FrontFacing ? record.y : record.z) == NONE) discard;
    oPicked = uvec4(vTriangle + 1u, floatBitsToUint(vPlace.x), floatBitsToUint(vPlace.y), gl_FrontFacing ? 1u : 0u);
}`;

/** A frame into the means of all frames since the view rests. */
export const MEAN_FRAGMENT = `${HEAD}
in vec2 vFilm;
uniform sampler2D uKnown, uSampled, uKnownMean, uSampledMean;
uniform vec2 uShare; /* of this frame in the mean of either part */
layout(location = 0) out vec4 oKnown;
layout(location = 1) out vec4 oSampled;
void main() {
    ivec2 p = ivec2(gl_FragCoord.xy);
    vec4 known = texelFetch(uKnown, p, 0), sampled = texelFetch(uSampled, p, 0);
    oKnown = uShare.x >= 1.0 ? known : mix(texelFetch(uKnownMean, p, 0), known, uShare.x);
    oSampled = uShare.y >= 1.0 ? sampled : mix(texelFetch(uSampledMean, p, 0), sampled, uShare.y);
}`;

/** Logarithms of luminance for automatic exposure, of a grid of points: log₂ times weight, weight. */
export const METER_FRAGMENT = `${HEAD}
in vec2 vFilm;
uniform sampler2D uKnown, uSampled;
layout(location = 0) out vec4 oMeter;
void main() {
    ivec2 size = textureSize(uKnown, 0);
    vec2 sum = vec2(0.0);
    for (int k = 0; k < 4; k++) {
        vec2 shift = vec2(float(k & 1), float(k >> 1)) * 0.5 - 0.25;
        ivec2 p = clamp(ivec2((vFilm + shift / 48.0) * vec2(size)), ivec2(0), size - 1);
        float l = dot(texelFetch(uKnown, p, 0).rgb, vec3(0.2126, 0.7152, 0.0722));
        float w = l > 0.0 ? texelFetch(uSampled, p, 0).a : 0.0;
        sum += vec2(w * log2(max(l, 1e-30)), w);
    }
    oMeter = vec4(sum, 0.0, 1.0);
}`;

/** What the screen shows: tone curves of crates/render/src/display/curves.rs, or false colours. */
export const SHOW_FRAGMENT = `${HEAD}
in vec2 vFilm;
uniform sampler2D uKnown, uSampled, uColours;
uniform float uSampledShare, uGain, uPart;
uniform int uCurve; /* 0 AgX, 1 ACES, 2 Reinhard, 3 none, 4 false colour */
uniform vec3 uRange; /* least, most, 1 if logarithmic */
layout(location = 0) out vec4 oColor;
float luminance(vec3 c) { return dot(c, vec3(0.2126, 0.7152, 0.0722)); }
vec3 encoded(vec3 c) {
    c = clamp(c, 0.0, 1.0);
    return mix(12.92 * c, 1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, c));
}
/* AgX of Troy Sobotka, by the polynomial and with the "punchy" look of the engine. */
vec3 agx(vec3 c) {
    const mat3 inset = mat3(
        0.842479062253094, 0.0423282422610123, 0.0423756549057051,
        0.0784335999999992, 0.878468636469772, 0.0784336,
        0.0792237451477643, 0.0791661274605434, 0.879142973793104);
    vec3 white = inset * vec3(1.0);
    vec3 v = inset * max(c, 0.0) / white;
    vec3 x = clamp((log2(max(v, 1e-10)) + 12.47393) / 16.499999, 0.0, 1.0);
    vec3 x2 = x * x, x4 = x2 * x2;
    v = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
    v = pow(max(v, 0.0), vec3(1.12));
    v = mix(vec3(luminance(v)), v, 1.18);
    return inverse(inset) * (v * white);
}
vec3 aces(vec3 c) {
    const mat3 inward = mat3(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
    const mat3 outward = mat3(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
    vec3 v = inward * (max(c, 0.0) * (0.263147 / 0.18)) / (inward * vec3(1.0));
    v = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
    return outward * v / (outward * vec3(1.0));
}
void main() {
    vec4 known = texture(uKnown, vFilm * uPart);
    vec3 c = known.rgb;
    if (uCurve == 4) {
        if (known.a < 0.5) { oColor = vec4(0.1, 0.1, 0.11, 1.0); return; }
        float x = c.r / known.a * uGain;
        float t = uRange.z > 0.5 ? log(max(x, 1e-20) / uRange.x) / log(uRange.y / uRange.x) : (x - uRange.x) / (uRange.y - uRange.x);
        oColor = vec4(texture(uColours, vec2((clamp(t, 0.0, 1.0) * 255.0 + 0.5) / 256.0, 0.5)).rgb, 1.0);
        return;
    }
    c = max(c + uSampledShare * texture(uSampled, vFilm * uPart).rgb, 0.0) * uGain;
    vec3 shown;
    if (uCurve == 0) shown = agx(c);
    else if (uCurve == 1) shown = encoded(aces(c));
    else if (uCurve == 2) shown = encoded(c * (1.0 + luminance(c) / 16.0) / (1.0 + luminance(c)));
    else shown = encoded(c);
    /* Half a step of noise against bands. */
    float noise = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(0.06711056, 0.00583715))));
    oColor = vec4(clamp(shown, 0.0, 1.0) + (noise - 0.5) / 255.0, 1.0);
}`;
