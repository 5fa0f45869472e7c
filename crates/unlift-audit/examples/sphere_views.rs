//! Prints how alike the views from the center of sphere clouds and those of all true points are, for
//! docs/protect_tables.py: a line per scheme with SSIM and LPIPS, means of six views, and those of one color.
//!
//! ```text
//! cargo run --release -p unlift-audit --example sphere_views -- MODEL DESCRIPTORS
//! ```

use std::error::Error;
use std::path::PathBuf;

use unlift::Unit;
use unlift::neighbors::{DescriptorKind, Neighborhoods};
use unlift::obfuscate::{SchemeOptions, obfuscate, scheme};
use unlift::recover::Recovered;
use unlift::seed::Key;
use unlift_audit::inversion::{Painter, on_bearings, six_views};
use unlift_audit::{Preparation, maps};
use unlift_vision::features::ColorImage;
use unlift_vision::pictures::{Inverter, Lpips, Metrics};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut next = || arguments.next().map(PathBuf::from).ok_or("expected MODEL DESCRIPTORS");
    let (model, descriptors) = (next()?, next()?);
    let (_, prepared) = maps::open(&model, Some(&descriptors), &Preparation::default())?;
    let plain = prepared.descriptors.as_ref().ok_or("expected descriptors")?;
    let painter = Painter::try_new(Inverter::of(DescriptorKind::of(plain, "DESCRIPTORS")?)?)?;
    let (lpips, positions) = (Lpips::try_new()?, prepared.original.reveal().positions());
    let name = "sphere";
    let scheme = scheme(name)?.of_dimension::<3>(&SchemeOptions::usual(Unit::KthNeighbor));
    let scheme = scheme.ok_or("expected a scheme in 3D")?;
    let (released, secret) =
        obfuscate(&*scheme, &prepared.original, Some(plain), &Key::from_seed(0))?;
    let origin = released.origin();
    let place = |slot: usize| {
        let point = positions[secret.hidden()[slot].index()];
        std::array::from_fn(|c| (point[c] - origin[c]) as f32)
    };
    let places: Vec<[f32; 3]> = (0..secret.n_slots()).map(place).collect();
    let none = Neighborhoods::try_new(vec![0; places.len() + 1], vec![], None, places.len(), 1)?;
    let truth = Recovered::from_positions(&released, &none, &places)?;
    let (seen, views) = (on_bearings(&released)?, six_views(&released)?);
    let mut means = [0.0; 4];
    for (_, view) in &views {
        let [truth, seen] = [&truth, &seen].map(|points| painter.map(view, &released, points));
        let truth = truth?;
        let metrics = [seen?, one_color(&truth)?].map(|other| Metrics::of(&other, &truth, &lpips));
        for (at, metrics) in metrics.into_iter().enumerate() {
            let metrics = metrics?;
            means[2 * at] += metrics.ssim / views.len() as f64;
            means[2 * at + 1] += metrics.lpips / views.len() as f64;
        }
    }
    let [ssim, lpips, ssim_of_one, lpips_of_one] = means;
    println!("{name} {ssim:.3} {lpips:.3} {ssim_of_one:.3} {lpips_of_one:.3}");
    Ok(())
}

/// Returns a picture of the same size in the mean color.
fn one_color(of: &ColorImage) -> Result<ColorImage, unlift::Error> {
    let n = of.width() * of.height();
    let mean = |color: usize| {
        let sum: u64 = of.pixels().iter().skip(color).step_by(3).map(|&x| u64::from(x)).sum();
        (sum / n as u64) as u8
    };
    let color = [0, 1, 2].map(mean);
    ColorImage::try_new(of.width(), of.height(), color.repeat(n))
}
