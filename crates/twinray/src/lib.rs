//! The front door of twinray: the libraries under one name.
//!
//! Data flows one way: [`mod@format`] reads bytes into a [`scene::Scene`]; [`scene::PatchScene`] cuts it into patches;
//! [`solve::Solver`] shoots bi-directional rays; [`solve::Solution`] is the light of the whole scene; [`render`]
//! makes pictures of it, [`bake`] textures for its own meshes; [`mod@format`] writes them.
//!
//! ```
//! use twinray::render::{self, Exposure, PictureOptions, ToneCurve};
//! use twinray::scene::{PatchBudget, PatchOptions, PatchScene, builtin};
//! use twinray::solve::{Observer, Params, Solver};
//!
//! // From an author's scene to patches,
//! let authored = builtin::cornell(false);
//! let camera = &authored.cameras[0];
//! let budget = PatchBudget::Count(5_000);
//! let scene = PatchScene::new(&authored, PatchOptions { budget, ..PatchOptions::default() })?;
//! // to the light of the scene,
//! let mut solver = Solver::new(&scene, Params::default_preset(1), Some(Observer::new(&scene, camera)))?;
//! solver.run(200_000);
//! let solution = solver.solution();
//! // to a picture.
//! let options = PictureOptions { width: 64, height: 64, ..PictureOptions::default() };
//! let picture = render::render(&scene, &solution, camera, &options);
//! let bytes = render::display::to_srgb8(&picture, Exposure::Auto.factor(&picture), ToneCurve::AgX);
//! let png = twinray::format::write_png(64, 64, &bytes, &[]);
//! assert!(png.starts_with(b"\x89PNG"));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub use twinray_bake as bake;
pub use twinray_format as format;
pub use twinray_render as render;
pub use twinray_scene as scene;
pub use twinray_solve as solve;
