//! Two pictures: measures by pixel, ꟻLIP, and a picture of the difference.

use anyhow::{anyhow, bail};
use serde_json::json;
use twinray::format::{self, PictureFile};
use twinray::render::compare::{FlipMap, flip, psnr, relative_mse, rmse};

use crate::args::{CompareArgs, MetricArg};
use crate::commands::compare::verdict;
use crate::failure::Ending;
use crate::input;
use crate::output::{Output, extension};

/// Compares `args.test` with `args.reference`.
pub fn run(args: &CompareArgs) -> anyhow::Result<Ending> {
    let (test, reference) = (input::read_picture(&args.test)?, input::read_picture(&args.reference)?);
    check(args, &test, &reference)?;
    if let Some(path) = args.diff.as_ref().filter(|path| extension(path) != "png") {
        bail!("{}: expected a name that ends in .png", path.display());
    }
    let output = args.diff.as_deref().map(Output::open).transpose()?;
    let measures = Measures::of(&test, &reference);
    if let Some(output) = output {
        let map = &measures.flip;
        let text = [("Software", concat!("twinray ", env!("CARGO_PKG_VERSION")))];
        output.write(&format::write_png(map.width, map.height, &map.magma(), &text))?;
    }
    measures.print(args);
    let metric = args.metric.unwrap_or(MetricArg::Flip);
    let (name, value) = measures.get(metric);
    let limit = args.max_error.map_or(f64::NAN, |limit| limit.value);
    // PSNR is the only measure of which more is better. A value that is no number is never within.
    let is_within = if matches!(metric, MetricArg::Psnr) { value >= limit } else { value <= limit };
    Ok(verdict(args, name, value, is_within))
}

/// What makes two pictures, or a measure of them, senseless.
fn check(args: &CompareArgs, test: &PictureFile, reference: &PictureFile) -> anyhow::Result<()> {
    let (a, b) = (&args.test, &args.reference);
    let size = |p: &PictureFile| (p.image.width, p.image.height);
    if size(test) != size(reference) {
        let [(w, h), (v, k)] = [size(test), size(reference)];
        bail!(
            "{a} has {w} x {h} pixels, {b} has {v} x {k}; expected pictures of one size: render both with the same --size"
        );
    }
    if test.display.is_some() != reference.display.is_some() {
        bail!("{a} and {b}: expected two PNG pictures or two EXR pictures; render both to the same kind of file");
    }
    if matches!(args.metric, Some(MetricArg::Psnr)) {
        if test.display.is_none() {
            bail!("{a}: PSNR needs the display values of PNG pictures; expected --metric flip, rmse or relmse for EXR");
        }
        if args.max_error.is_some_and(|limit| limit.percent) {
            return Err(anyhow!(
                "--max-error: PSNR is in decibels, and more is better; expected the least, such as 40"
            ));
        }
    }
    Ok(())
}

struct Measures {
    flip: FlipMap,
    rmse: f64,
    relative_mse: f64,
    psnr: Option<f64>,
}

impl Measures {
    fn of(test: &PictureFile, reference: &PictureFile) -> Self {
        let (a, b) = (&test.image, &reference.image);
        let display = test.display.as_ref().zip(reference.display.as_ref());
        Self {
            flip: if display.is_some() { flip::ldr(a, b) } else { flip::hdr(a, b) },
            rmse: rmse(&a.pixels, &b.pixels),
            relative_mse: relative_mse(&a.pixels, &b.pixels),
            psnr: display.map(|(a, b)| psnr(a, b)),
        }
    }

    fn get(&self, metric: MetricArg) -> (&'static str, f64) {
        match metric {
            MetricArg::Rmse => ("RMSE", self.rmse),
            MetricArg::Relmse => ("relMSE", self.relative_mse),
            MetricArg::Psnr => ("PSNR", self.psnr.unwrap_or(f64::NAN)),
            MetricArg::Flip => ("the mean of FLIP", self.flip.mean()),
        }
    }

    fn print(&self, args: &CompareArgs) {
        let (width, height) = (self.flip.width, self.flip.height);
        let range = if self.psnr.is_some() { "LDR" } else { "HDR" };
        if args.json {
            let report = json!({
                "kind": "pictures", "test": args.test, "reference": args.reference,
                "width": width, "height": height,
                "flip": { "mean": self.flip.mean(), "max": self.flip.max(), "range": range },
                "rmse": self.rmse, "relmse": self.relative_mse,
                // Of equal pictures PSNR is infinite, for which JSON has null.
                "psnr": self.psnr,
                "equal": self.rmse == 0.0,
            });
            println!("{report:#}");
        } else if !args.quiet {
            println!("{} against {}, {width} x {height} pixels", args.test, args.reference);
            println!("FLIP     mean {:.6}, largest {:.4} ({range}-FLIP)", self.flip.mean(), self.flip.max());
            println!("RMSE     {:.6} (linear light)", self.rmse);
            println!("relMSE   {:.6} (linear light)", self.relative_mse);
            if let Some(psnr) = self.psnr {
                println!("PSNR     {psnr:.2} dB (display values)");
            }
        }
    }
}
