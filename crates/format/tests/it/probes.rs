//! Irradiance volumes: what other programs read of them.

use exr::prelude::{AttributeValue, FlatSamples, ReadChannels, ReadLayers, f16, read};
use twinray_format::{
    BevyVolumeError, ProbeArrays, ProbeLattice, write_bevy_volume, write_probes_exr, write_probes_json,
};

const LATTICE: ProbeLattice = ProbeLattice { low: [-1.0, 0.5, 2.0], cell: [0.5, 0.25, 1.0], counts: [3, 4, 2] };

/// A texture as graphics processors have it.
struct Texture {
    size: [usize; 3],
    texels: Vec<[f32; 3]>,
}

impl Texture {
    /// From a KTX2 file of one level, by the offsets of its specification.
    fn new(file: &[u8]) -> Self {
        let word = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four bytes"));
        let long = |at: usize| u64::from_le_bytes(file[at..at + 8].try_into().expect("eight bytes")) as usize;
        assert_eq!(&file[..12], b"\xABKTX 20\xBB\r\n\x1A\n");
        assert_eq!([word(12), word(16)], [97, 2], "format and size of its numbers");
        let size = [20, 24, 28].map(|at| word(at) as usize);
        assert_eq!([word(32), word(36), word(40), word(44)], [0, 1, 1, 0], "layers, faces, levels, supercompression");
        let [descriptor, length, words, words_length] = [48, 52, 56, 60].map(|at| word(at) as usize);
        assert_eq!((descriptor, word(descriptor) as usize), (104, length));
        assert_eq!((words, long(64), long(72)), (descriptor + length, 0, 0));
        let (at, length, unpacked) = (long(80), long(88), long(96));
        assert!(at % 8 == 0 && at >= words + words_length && length == unpacked && at + length == file.len());
        assert_eq!(length, 8 * size.iter().product::<usize>());
        let texels = file[at..].chunks_exact(8).map(|texel| {
            let number = |c: usize| f16::from_bits(u16::from_le_bytes([texel[2 * c], texel[2 * c + 1]])).to_f32();
            assert_eq!(number(3), 1.0);
            [0, 1, 2].map(number)
        });
        Self { size, texels: texels.collect() }
    }

    /// Trilinear, clamped at the edges, at coordinates in [0, 1].
    fn sample(&self, place: [f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for corner in 0..8 {
            let (mut index, mut weight, mut stride) = (0, 1.0, 1);
            for (axis, coordinate) in place.into_iter().enumerate() {
                let texel = coordinate * self.size[axis] as f64 - 0.5;
                let high = corner >> axis & 1 == 1;
                let share = texel - texel.floor();
                weight *= if high { share } else { 1.0 - share };
                let k = (texel.floor() + f64::from(u8::from(high))).clamp(0.0, (self.size[axis] - 1) as f64);
                index += stride * k as usize;
                stride *= self.size[axis];
            }
            (0..3).for_each(|c| sum[c] += weight * f64::from(self.texels[index][c]));
        }
        sum
    }

    /// What Bevy's shader makes of the texture at a point of the volume's unit cube, centred at the origin, for a normal:
    /// its `irradiance_volume.wgsl`, retold. A component below 0 is half of the texture's height further.
    fn bevy(&self, point: [f64; 3], normal: [f64; 3]) -> [f64; 3] {
        let size = self.size.map(|n| n as f64);
        let resolution = [size[0], size[1] / 2.0, size[2] / 3.0];
        let base: [f64; 3] =
            std::array::from_fn(|a| ((point[a] + 0.5) * resolution[a]).clamp(0.5, resolution[a] - 0.5) / size[a]);
        let mut sum = [0.0; 3];
        for (axis, component) in normal.into_iter().enumerate() {
            let below = if component < 0.0 { 0.5 } else { 0.0 };
            let light = self.sample([base[0], base[1] + below, base[2] + axis as f64 / 3.0]);
            (0..3).for_each(|c| sum[c] += light[c] * component * component);
        }
        sum
    }
}

/// Different for every probe and side, and linear in space.
fn cubes() -> Vec<[[f32; 3]; 6]> {
    let [nx, ny, _] = LATTICE.counts.map(|n| n as usize);
    (0..LATTICE.len())
        .map(|p| {
            let [i, j, k] = [p % nx, p / nx % ny, p / (nx * ny)].map(|n| n as f32);
            std::array::from_fn(|side| [i + 8.0 * j + 64.0 * k, 100.0 * side as f32, 2.0])
        })
        .collect()
}

/// The order of sides is +x, +y, +z, −x, −y, −z for Bevy's shader, as the table of its documentation has it.
#[test]
fn bevy_reads_each_side_where_it_is() {
    let texture = Texture::new(&write_bevy_volume(&LATTICE, &cubes(), "test").expect("a texture"));
    assert_eq!(texture.size, [3, 8, 6]);
    let [nx, ny, nz] = LATTICE.counts.map(f64::from);
    let close = |a: [f64; 3], b: [f64; 3]| (0..3).all(|c| (a[c] - b[c]).abs() < 1e-6 * (1.0 + b[c].abs()));
    for (i, j, k) in [(0.0, 0.0, 0.0), (2.0, 3.0, 1.0), (1.0, 2.0, 0.0), (1.5, 0.25, 0.5), (0.0, 3.0, 0.75)] {
        let point = [(i + 0.5) / nx - 0.5, (j + 0.5) / ny - 0.5, (k + 0.5) / nz - 0.5];
        for side in 0..6 {
            let mut normal = [0.0; 3];
            normal[side % 3] = if side < 3 { 1.0 } else { -1.0 };
            let found = texture.bevy(point, normal);
            let expected = [i + 8.0 * j + 64.0 * k, 100.0 * side as f64, 2.0];
            assert!(close(found, expected), "({i}, {j}, {k}), side {side}: {found:?}, {expected:?}");
        }
        // Squares of the components weigh the sides: −x, +y, −z are 3, 1, 5.
        let found = texture.bevy(point, [-0.6, 0.48, -0.64]);
        let expected = 100.0 * (3.0 * 0.36 + 0.2304 + 5.0 * 0.4096);
        assert!((found[1] - expected).abs() < 1e-6 * expected);
    }
    // Beyond the middles of the outer boxes nothing of other sides bleeds in.
    for corner in 0..8 {
        let point = [0, 1, 2].map(|a| if corner >> a & 1 == 1 { 0.5 } else { -0.5 });
        let normal = [0.6, -0.48, 0.64];
        assert!((texture.bevy(point, normal)[1] - 100.0 * (0.2304 * 4.0 + 0.4096 * 2.0)).abs() < 1e-4);
    }
}

#[test]
fn what_halves_cannot_hold_is_cut_and_what_processors_cannot_sample_is_refused() {
    let one = ProbeLattice { counts: [1; 3], ..LATTICE };
    let file = write_bevy_volume(&one, &[[[1e9, -1.0, f32::NAN]; 6]], "test").expect("a texture");
    assert_eq!(Texture::new(&file).texels[0], [65504.0, 0.0, 0.0]);
    let long = ProbeLattice { counts: [1, 1, 683], ..LATTICE };
    let error = write_bevy_volume(&long, &vec![[[0.0; 3]; 6]; 683], "test");
    assert_eq!(error, Err(BevyVolumeError::TooLarge([1, 2, 2049])));
}

/// Arrays of numbers that are all different.
#[derive(Default)]
struct Arrays {
    radiance: Vec<[[f32; 3]; 9]>,
    validity: Vec<f32>,
    offset: Vec<[f32; 3]>,
    nearness: Vec<[f32; 26]>,
}

impl Arrays {
    fn new() -> Self {
        let mut next = 0.1f32;
        let mut number = || {
            next *= 1.01;
            next
        };
        let mut all = Self::default();
        for _ in 0..LATTICE.len() {
            all.radiance.push(std::array::from_fn(|_| std::array::from_fn(|_| number())));
            all.validity.push(number());
            all.offset.push(std::array::from_fn(|_| -number()));
            all.nearness.push(std::array::from_fn(|_| number()));
        }
        all
    }

    fn view(&self) -> ProbeArrays<'_> {
        let Self { radiance, validity, offset, nearness } = self;
        ProbeArrays { lattice: LATTICE, radiance, validity, offset, nearness }
    }
}

#[test]
fn json_reads_back_to_the_bit() {
    let arrays = Arrays::new();
    let text = write_probes_json(&arrays.view(), "nit", &[("scene", "a \"room\"")]);
    let read: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((&read["unit"], &read["provenance"]["scene"]), (&"nit".into(), &"a \"room\"".into()));
    assert_eq!(read["cell"][1].as_f64(), Some(0.25));
    assert_eq!(read["neighbours"][25], serde_json::json!([1, 1, 1]));
    let probes = read["probes"].as_array().expect("probes");
    assert_eq!(probes.len(), LATTICE.len());
    let single = |v: &serde_json::Value| v.as_f64().map(|v| v as f32);
    for (i, probe) in probes.iter().enumerate() {
        assert_eq!(single(&probe["validity"]), Some(arrays.validity[i]));
        for k in 0..3 {
            assert_eq!(single(&probe["offset"][k]), Some(arrays.offset[i][k]));
            (0..9).for_each(|h| assert_eq!(single(&probe["radiance"][h][k]), Some(arrays.radiance[i][h][k])));
        }
        (0..26).for_each(|n| assert_eq!(single(&probe["nearness"][n]), Some(arrays.nearness[i][n])));
    }
}

#[test]
fn exr_has_a_row_of_boxes_in_each_row() {
    let arrays = Arrays::new();
    let bytes = write_probes_exr(&arrays.view(), Some(1.0), &[("scene", "room")]);
    assert_eq!(bytes, write_probes_exr(&arrays.view(), Some(1.0), &[("scene", "room")]));
    let image = read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer().all_attributes();
    let image = image.from_buffered(std::io::Cursor::new(bytes)).expect("EXR");
    assert_eq!((image.layer_data.size.0, image.layer_data.size.1), (3, 8));
    let channel = |name: &str| {
        let list = &image.layer_data.channel_data.list;
        match list.iter().find(|c| c.name.to_string() == name).map(|c| &c.sample_data) {
            Some(FlatSamples::F32(values)) => values.clone(),
            _ => panic!("no channel {name}"),
        }
    };
    for i in 0..LATTICE.len() {
        assert_eq!(channel("sh0.R")[i], arrays.radiance[i][0][0]);
        assert_eq!(channel("sh8.B")[i], arrays.radiance[i][8][2]);
        assert_eq!(channel("offset.Y")[i], arrays.offset[i][1]);
        assert_eq!(channel("validity.Y")[i], arrays.validity[i]);
        assert!((channel("G")[i] / arrays.radiance[i][0][1] - 0.282_094_8).abs() < 1e-6);
    }
    let own = &image.layer_data.attributes.other;
    let low = own.iter().chain(&image.attributes.other).find(|(name, _)| **name == *"probes.low");
    assert!(matches!(low, Some((_, AttributeValue::Text(text))) if *text == *"-1 0.5 2"), "{low:?}");
}
