use std::time::Instant;
use twinray_scene::*;
use twinray_solve::*;
use twinray_render::*;
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let a = builtin::by_name(&args[1]).unwrap();
    let rays: f64 = args[2].parse().unwrap();
    let paper = args.get(4).is_some_and(|s| s == "paper");
    let k = a.suggested_patches.unwrap_or(20000);
    let scene = PatchScene::new(&a, PatchOptions { budget: PatchBudget::Count(k), two_sided: false }).unwrap();
    let cam = &a.cameras[0];
    let t = Instant::now();
    let p = if paper { Params::paper_preset(1) } else { Params::default_preset(1) };
    let mut s = Solver::new(&scene, p, Some(Observer::new(&scene, cam))).unwrap();
    s.run(rays as u64);
    let sol = s.solution();
    println!("{} K {} rays {} est {:.4} {:?} {:.2}s", args[1], scene.len(), s.rays(), sol.relative_error(), sol.balance(), t.elapsed().as_secs_f64());
    let t = Instant::now();
    let w = 640; let h = (w as f64 / cam.aspect.unwrap_or(1.333)) as u32;
    for flat in [false, true] {
        let pic = render(&scene, &sol, cam, &PictureOptions { width: w, height: h, samples: 16, flat });
        println!("picture {:.2}s", t.elapsed().as_secs_f64());
        let px = display::to_srgb8(&pic.image, Exposure::Auto.factor(&pic), ToneCurve::AgX);
        ::image::save_buffer(format!("{}{}.png", args[3], if flat {"-flat"} else {""}), &px, w, h, ::image::ColorType::Rgb8).unwrap();
    }
}
