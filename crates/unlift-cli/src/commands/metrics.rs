//! `unlift metrics`: compares pictures.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::{Value, json};
use unlift_features::ColorImage;
use unlift_features::load::read_color;
use unlift_invert::{Lpips, Metrics};

use crate::args::MetricsArgs;
use crate::exit::{Outcome, usage};
use crate::output::{print, table};
use crate::stderr;

pub fn run(args: &MetricsArgs) -> anyhow::Result<Outcome> {
    let lpips = Lpips::try_new()?;
    let compare = |a: &Path, b: &Path| -> anyhow::Result<Metrics> {
        let (mut first, mut second) = (read_color(a)?, read_color(b)?);
        let half = |image: &ColorImage| (image.width() / 2, image.height() / 2);
        // Pictures of `unlift invert` have half the size of their photos.
        if half(&first) == (second.width(), second.height()) {
            first = first.halved()?;
        } else if half(&second) == (first.width(), first.height()) {
            second = second.halved()?;
        }
        Metrics::of(&first, &second, &lpips)
            .with_context(|| format!("{} and {}", a.display(), b.display()))
    };
    for path in [&args.a, &args.b] {
        path.metadata().map_err(|error| unlift_io::Error::read(path, error))?;
    }
    if args.a.is_dir() != args.b.is_dir() {
        return Err(usage(format!(
            "{} and {}: expected two pictures or two folders, found one of each",
            args.a.display(),
            args.b.display()
        )));
    }
    if !args.a.is_dir() {
        let metrics = compare(&args.a, &args.b)?;
        print(&if args.json {
            serde_json::to_string_pretty(&object(&metrics))? + "\n"
        } else {
            let Metrics { ssim, psnr, lpips } = metrics;
            format!("SSIM  {ssim:.4}\nPSNR  {psnr:.2} dB\nLPIPS {lpips:.4}\n")
        })?;
        return Ok(Outcome::Done);
    }
    let (ours, theirs) = (pictures(&args.a)?, pictures(&args.b)?);
    for (these, those, other) in [(&ours, &theirs, &args.b), (&theirs, &ours, &args.a)] {
        for (_, path) in these.iter().filter(|(name, _)| !those.contains_key(*name)) {
            let (path, other) = (path.display(), other.display());
            stderr::tell(format_args!("unlift: {path}: no picture of this name in {other}"));
        }
    }
    let mut rows = Vec::new();
    for (name, path) in &ours {
        let Some(other) = theirs.get(name) else { continue };
        rows.push((name.clone(), compare(path, other)?));
    }
    if rows.is_empty() {
        let expected = format!("pictures of the same names as in {}", args.b.display());
        return Err(unlift_io::Error::new(&args.a, "", expected, "none").into());
    }
    let mean = mean(rows.iter().map(|(_, metrics)| metrics));
    print(&if args.json {
        let pictures = rows.iter().map(|(name, metrics)| {
            let mut object = object(metrics);
            object["name"] = json!(name);
            object
        });
        let mut whole = object(&mean);
        whole["pictures"] = pictures.collect();
        serde_json::to_string_pretty(&whole)? + "\n"
    } else {
        let heads = ["picture", "SSIM", "PSNR dB", "LPIPS"].map(str::to_owned).to_vec();
        let all = rows.iter().map(|(name, metrics)| (name.as_str(), metrics));
        let cells = all.chain([("mean", &mean)]).map(|(name, m)| {
            let figures =
                [format!("{:.4}", m.ssim), format!("{:.2}", m.psnr), format!("{:.4}", m.lpips)];
            [name.to_owned()].into_iter().chain(figures).collect()
        });
        table(&[heads].into_iter().chain(cells).collect::<Vec<_>>(), &[])
    })?;
    Ok(Outcome::Done)
}

/// Returns the pictures of a folder by name, without extensions: `a.jpg.png`, as `unlift invert`
/// writes it, is `a`.
fn pictures(folder: &Path) -> anyhow::Result<BTreeMap<String, PathBuf>> {
    let read = |error| unlift_io::Error::read(folder, error);
    let mut found = BTreeMap::new();
    for entry in folder.read_dir().map_err(read)? {
        let path = entry.map_err(read)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut bare = name.as_str();
        while let Some((stem, kind)) = bare.rsplit_once('.')
            && ["jpg", "jpeg", "jpe", "jfif", "png", "webp"]
                .iter()
                .any(|known| kind.eq_ignore_ascii_case(known))
        {
            bare = stem;
        }
        if bare.len() == name.len() || !path.is_file() {
            continue;
        }
        if let Some(other) = found.insert(bare.to_owned(), path.clone()) {
            let (expected, found) = ("one picture of a name", other.display().to_string());
            return Err(unlift_io::Error::new(&path, "", expected, found).into());
        }
    }
    Ok(found)
}

/// Converts metrics to JSON. The PSNR of equal pictures is infinite: `null`.
fn object(metrics: &Metrics) -> Value {
    let psnr = metrics.psnr.is_finite().then_some(metrics.psnr);
    json!({ "ssim": metrics.ssim, "psnr": psnr, "lpips": metrics.lpips })
}

fn mean<'a>(all: impl Iterator<Item = &'a Metrics> + Clone) -> Metrics {
    let n = all.clone().count() as f64;
    let of = |figure: fn(&Metrics) -> f64| all.clone().map(figure).sum::<f64>() / n;
    Metrics { ssim: of(|m| m.ssim), psnr: of(|m| m.psnr), lpips: of(|m| m.lpips) }
}
