//! `unlift export`: writes stage files of maps in formats of other programs.

use std::path::Path;

use unlift::geometry::frame::Bounds;
use unlift::released::{Obfuscation, Released};
use unlift::{OneLine, Unit};
use unlift_audit::{check_file, refused};
use unlift_io::atomic::Access;
use unlift_io::clouds::{
    Segment, record_segments, write_cameras, write_images, write_lines, write_model_points,
    write_points,
};
use unlift_io::outputs::{Kind, OutputSet, Rules};
use unlift_io::read::{self, colmap};
use unlift_io::stage::{
    Kind as Stage, has_images, kind, read_recovered, read_released, read_truth,
};

use crate::args::ExportArgs;
use crate::exit::{Outcome, advise, usage};
use crate::output::print;

enum Shown {
    /// A row per slot or original; `None` for lost points.
    Points(Vec<Option<[f64; 3]>>),
    Segments(Vec<Segment<3>>),
}

pub fn run(args: &ExportArgs) -> crate::Result<Outcome> {
    let inputs = [Some(args.path.as_path()), args.cameras.as_deref()];
    let rules = Rules::new(inputs.into_iter().flatten(), false);
    let ending = args.out.extension().map(|ending| ending.to_ascii_lowercase());
    let ending = ending.as_ref().map(|ending| ending.to_string_lossy());
    let ending = ending.as_deref();
    if args.cameras.is_some() && matches!(ending, Some("ply" | "obj")) {
        let found = OneLine(args.out.display());
        return Err(usage(format!("--cameras: expected a folder as --out, found {found}")));
    }
    let n = match ending {
        Some("ply" | "obj") => {
            check_file(&args.out, Kind::Cloud, &rules)?;
            let shown = scaled(args, read(&args.path)?)?;
            cloud(args, ending, &shown)?
        }
        Some(_) if !args.out.is_dir() => {
            let found = OneLine(args.out.display());
            return Err(usage(format!(
                "--out: expected a name that ends in .ply or .obj, or a folder without an ending, found {found}"
            )));
        }
        _ => model(args, rules)?,
    };
    print(&format!("{n}, in {}\n", OneLine(args.out.display())))?;
    Ok(Outcome::Done)
}

/// Writes a PLY or OBJ file, and returns a description of its content.
fn cloud(args: &ExportArgs, ending: Option<&str>, shown: &Shown) -> crate::Result<String> {
    let wrong = |expected: &str, found: &str, way_out: &str| {
        Err(advise(unlift_io::Error::new(&args.path, "", expected, found), way_out))
    };
    match (ending, shown) {
        (Some("ply"), Shown::Points(points)) => {
            let points: Vec<[f64; 3]> = points.iter().flatten().copied().collect();
            write_points(&args.out, &points)?;
            Ok(format!("{} points", points.len()))
        }
        (Some("obj"), Shown::Segments(segments)) => {
            write_lines(&args.out, segments)?;
            Ok(format!("{} segments", segments.len()))
        }
        (_, Shown::Points(_)) => {
            wrong("lines or rays, as --out is .obj", "points", "--out NAME.ply")
        }
        (_, Shown::Segments(_)) => {
            wrong("points, as --out is .ply", "lines or rays", "--out NAME.obj")
        }
    }
}

fn model(args: &ExportArgs, rules: Rules) -> crate::Result<String> {
    let names = ["cameras.txt", "images.txt", "points3D.txt"];
    let first = names.map(|name| (name, Kind::Model));
    let mut out = OutputSet::create(&args.out, rules, Access::Private, &first).map_err(refused)?;
    let Shown::Points(points) = scaled(args, read(&args.path)?)? else {
        let error = unlift_io::Error::new(&args.path, "", "points, for a model", "lines or rays");
        return Err(advise(error, "--out NAME.obj"));
    };
    let (cameras, images) = match &args.cameras {
        None => (Vec::new(), Vec::new()),
        Some(project) => views(project)?,
    };
    let [cameras_txt, images_txt, points_txt] = names.map(|name| out.stage(name, Kind::Model));
    write_cameras(&cameras_txt?, &cameras)?;
    write_images(&images_txt?, &images)?;
    write_model_points(&points_txt?, &points)?;
    out.commit()?;
    let n = points.iter().flatten().count();
    Ok(format!("a model of {n} points, {} cameras and {} images", cameras.len(), images.len()))
}

fn views(project: &Path) -> crate::Result<(Vec<colmap::Camera>, Vec<colmap::Image>)> {
    match read::open(project)?.model {
        Some(folder) => Ok(colmap::read_views(&folder)?),
        None => {
            let expected = "a COLMAP model with cameras";
            Err(unlift_io::Error::new(project, "", expected, "only points").into())
        }
    }
}

/// Reads the file at `path`, and returns its content and its unit.
fn read(path: &Path) -> crate::Result<(Shown, Unit)> {
    let kind = kind(path)?;
    let wrong = |found: &str| {
        let expected = "a released, recovered or truth file of a map";
        Err(unlift_io::Error::new(path, "", expected, found).into())
    };
    if has_images(path)? {
        return wrong("one of images");
    }
    match kind {
        Stage::Released => {
            let released = read_released::<3>(path)?;
            let origin = released.origin();
            let unit = released.unit();
            match released.obfuscation() {
                Obfuscation::Lines(_) | Obfuscation::Rays(_) => {
                    let n = released.n_records();
                    let segments = record_segments(&released, &surroundings(&released), 0..n);
                    Ok((Shown::Segments(segments), unit))
                }
                Obfuscation::AxisCandidates(candidates) => {
                    let place =
                        |p: &[f32; 3]| Some(std::array::from_fn(|c| f64::from(p[c]) + origin[c]));
                    Ok((Shown::Points(candidates.position().iter().map(place).collect()), unit))
                }
                Obfuscation::AxisPlanes(_) => wrong("planes, which have no end"),
            }
        }
        Stage::Recovered => {
            let recovered = read_recovered::<3>(path)?;
            let points = (0..recovered.n_slots()).map(|slot| recovered.position(slot)).collect();
            Ok((Shown::Points(points), recovered.unit()))
        }
        Stage::Truth => {
            let (original, _) = read_truth::<3>(path)?;
            let points = original.reveal();
            let places = points.positions().iter().copied().map(Some).collect();
            Ok((Shown::Points(places), points.unit()))
        }
        Stage::Neighborhoods | Stage::PointNeighborhoods => wrong("neighborhoods"),
    }
}

/// Converts lengths to the units of the map, if `--scale` is given.
fn scaled(args: &ExportArgs, (mut shown, unit): (Shown, Unit)) -> crate::Result<Shown> {
    let Some(scale) = args.scale else { return Ok(shown) };
    if unit != Unit::Meter {
        let expected = "a file in meters (obfuscate --scale)";
        let path = args.path.display();
        return Err(usage(format!(
            "--scale: expected {expected}, found {path} in {}",
            unit.name()
        )));
    }
    let points = match &mut shown {
        Shown::Points(points) => points.iter_mut().flatten().collect::<Vec<_>>(),
        Shown::Segments(segments) => segments.iter_mut().flatten().collect(),
    };
    for point in points {
        *point = point.map(|x| x / scale);
    }
    Ok(shown)
}

/// Estimates from the records alone a box that holds most of the hidden points. Lines: the box of
/// the feet without 1 % at each end, extended by half its width. Rays: the box of the centers,
/// extended by three times its width.
fn surroundings(released: &Released<3>) -> Bounds<3> {
    let (places, left_out, around) = match released.obfuscation() {
        Obfuscation::Lines(lines) => (lines.foot(), 0.01, 0.5),
        Obfuscation::Rays(rays) => (rays.centers(), 0.0, 3.0),
        Obfuscation::AxisPlanes(_) | Obfuscation::AxisCandidates(_) => (&[][..], 0.0, 0.0),
    };
    let origin = released.origin();
    let place = |p: &[f32; 3]| std::array::from_fn(|c| f64::from(p[c]) + origin[c]);
    let places: Vec<[f64; 3]> = places.iter().map(place).collect();
    let bounds = Bounds::quantiles(&places, left_out);
    let Bounds { low, high } = bounds.unwrap_or(Bounds { low: origin, high: origin });
    let widest = (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max);
    // All places may coincide: then extend by one unit.
    let more = if widest > 0.0 { around * widest } else { 1.0 };
    Bounds { low: low.map(|x| x - more), high: high.map(|x| x + more) }
}
