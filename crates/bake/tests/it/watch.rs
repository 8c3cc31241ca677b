//! Bakes tell how far they are, and end when they are told to.

use twinray_bake::{
    AtlasError, AtlasOptions, Cancelled, LightmapOptions, ProbeError, ProbeOptions, Quality, Stage, TexelDensity, bake,
    bake_probes, bake_vertices,
};
use twinray_scene::builtin;

use crate::scenes::{cut, solve};

/// What was told of a stage, until the share at which it is to stop.
fn told(stage: Stage, stop: f64, bake: impl FnOnce(&mut twinray_bake::Watch<'_>)) -> Vec<f64> {
    let mut shares = Vec::new();
    bake(&mut |of, share| {
        if of == stage {
            shares.push(share);
        }
        if of == stage && share >= stop { Err(Cancelled) } else { Ok(()) }
    });
    shares
}

#[test]
fn bakes_tell_how_far_they_are_and_stop() {
    let scene = builtin::cornell(false);
    let patches = cut(&scene, 0.05);
    let solution = solve(&patches, 10_000);
    let atlas = AtlasOptions { density: TexelDensity::OnePage, page_size: 64, padding: 2, keep_authored: true };
    let options = LightmapOptions { atlas, quality: Quality::Smooth, stitch: true, seed: 1 };
    let stages = [Stage::Texels, Stage::Vertices, Stage::Probes];
    for (stage, stop) in stages.into_iter().flat_map(|stage| [(stage, 2.0), (stage, 0.0)]) {
        let mut stopped = false;
        let shares = told(stage, stop, |watch| {
            stopped = match stage {
                Stage::Vertices => {
                    let of = bake_vertices(&scene, &patches, &solution, Quality::Smooth, 1, watch);
                    matches!(of, Err(AtlasError::Cancelled(_)))
                }
                Stage::Probes => {
                    let of = bake_probes(&patches, &solution, &ProbeOptions { rays: 8, ..Default::default() }, watch);
                    matches!(of, Err(ProbeError::Cancelled(_)))
                }
                _ => matches!(bake(&scene, &patches, &solution, &options, watch), Err(AtlasError::Cancelled(_))),
            };
        });
        assert_eq!(stopped, stop < 1.0, "{stage:?}");
        assert!(shares.is_sorted() && shares.iter().all(|s| (0.0..=1.0).contains(s)), "{stage:?}: {shares:?}");
        match stopped {
            true => assert_eq!(shares.len(), 1, "{stage:?} goes on"),
            false => assert_eq!(shares.last(), Some(&1.0), "{stage:?} does not end"),
        }
    }
}
