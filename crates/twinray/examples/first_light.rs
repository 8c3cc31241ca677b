//! The first picture: a built-in scene, solved, seen, written as `first_light.png`.

use twinray::render::{self, Exposure, PictureOptions, ToneCurve};
use twinray::scene::{PatchOptions, PatchScene, builtin};
use twinray::solve::{Observer, Params, Solver};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let authored = builtin::cornell(false);
    let scene = PatchScene::new(&authored, PatchOptions::default())?;
    let camera = &authored.cameras[0];
    let mut solver = Solver::new(&scene, Params::default_preset(1), Some(Observer::new(&scene, camera)))?;
    solver.run(2_000_000);
    let options = PictureOptions { width: 400, height: 400, ..PictureOptions::default() };
    let picture = render::render(&scene, &solver.solution(), camera, &options);
    let bytes = render::display::to_srgb8(&picture, Exposure::Auto.factor(&picture), ToneCurve::AgX);
    std::fs::write("first_light.png", twinray::format::write_png(400, 400, &bytes, &[]))?;
    Ok(())
}
