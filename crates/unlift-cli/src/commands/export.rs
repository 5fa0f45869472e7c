//! `unlift export`: writes stage files of maps in formats of other programs.

use std::ffi::OsStr;
use std::path::Path;

use unlift::geometry::frame::Bounds;
use unlift::released::{Obfuscation, Released};
use unlift::{OneLine, Unit};
use unlift_audit::{bail, check_file, refused};
use unlift_io::Error as FileError;
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

use crate::Error;
use crate::args::ExportArgs;
use crate::output::print;

enum Shown {
    /// A row per slot or original; `None` for lost points.
    Points(Vec<Option<[f64; 3]>>),
    Segments(Vec<Segment<3>>),
}

pub fn run(args: &ExportArgs) -> crate::Result<()> {
    let inputs = [Some(args.path.as_path()), args.cameras.as_deref()];
    let rules = Rules::new(inputs.into_iter().flatten(), false);
    let ending = args.out.extension().map(OsStr::to_ascii_lowercase);
    let is = |name: &str| ending.as_deref().is_some_and(|ending| ending == name);
    let is_cloud = is("ply") || is("obj");
    let out = OneLine(args.out.display());
    if args.cameras.is_some() && is_cloud {
        bail!("--cameras: expected a folder as --out, found {out}");
    }
    let n = if is_cloud {
        check_file("--out", &args.out, Kind::Cloud, &rules)?;
        cloud(args, is("ply"))?
    } else if ending.is_some() && !args.out.is_dir() {
        bail!(
            "--out: expected a name that ends in .ply or .obj, or a folder without an ending, found {out}"
        );
    } else {
        model(args, rules)?
    };
    print(&format!("{n}, in {out}\n"))
}

/// Writes a PLY or OBJ file, and returns a description of its content.
fn cloud(args: &ExportArgs, is_ply: bool) -> crate::Result<String> {
    let wrong = |expected: &str, found: &str, way_out: &str| {
        Err(Error::from(FileError::new(&args.path, "", expected, found)).advise(way_out))
    };
    match scaled(args, read(&args.path)?)? {
        Shown::Points(points) if is_ply => {
            let points: Vec<[f64; 3]> = points.into_iter().flatten().collect();
            write_points(&args.out, &points)?;
            Ok(format!("{} points", points.len()))
        }
        Shown::Segments(segments) if !is_ply => {
            write_lines(&args.out, &segments)?;
            Ok(format!("{} segments", segments.len()))
        }
        Shown::Points(_) => wrong("lines or rays, as --out is .obj", "points", "--out NAME.ply"),
        Shown::Segments(_) => wrong("points, as --out is .ply", "lines or rays", "--out NAME.obj"),
    }
}

fn model(args: &ExportArgs, rules: Rules) -> crate::Result<String> {
    let names = ["cameras.txt", "images.txt", "points3D.txt"];
    let first = names.map(|name| (name, Kind::Model));
    let mut out = OutputSet::create(&args.out, rules, Access::Private, &first).map_err(refused)?;
    let Shown::Points(points) = scaled(args, read(&args.path)?)? else {
        let error = FileError::new(&args.path, "", "points, for a model", "lines or rays");
        return Err(Error::from(error).advise("--out NAME.obj"));
    };
    let (cameras, images) = match &args.cameras {
        None => (Vec::new(), Vec::new()),
        Some(project) => match read::open(project)?.model {
            Some(folder) => colmap::read_views(&folder)?,
            None => {
                let expected = "a COLMAP model with cameras";
                return Err(FileError::new(project, "", expected, "only points").into());
            }
        },
    };
    let [cameras_txt, images_txt, points_txt] = names.map(|name| out.stage(name, Kind::Model));
    write_cameras(&cameras_txt?, &cameras)?;
    write_images(&images_txt?, &images)?;
    write_model_points(&points_txt?, &points)?;
    out.commit()?;
    let n = points.iter().flatten().count();
    Ok(format!("a model of {n} points, {} cameras and {} images", cameras.len(), images.len()))
}

/// Reads the file at `path`, and returns its content and its unit.
fn read(path: &Path) -> crate::Result<(Shown, Unit)> {
    let kind = kind(path)?;
    let wrong = |found: &str| {
        let expected = "a released, recovered or truth file of a map";
        Err(FileError::new(path, "", expected, found).into())
    };
    if has_images(path)? {
        return wrong("one of images");
    }
    match kind {
        Stage::Released => {
            let released = read_released::<3>(path)?;
            let shown = match released.obfuscation() {
                Obfuscation::Lines(lines) => segments(&released, lines.foot(), 0.01, 0.5),
                Obfuscation::Rays(rays) => segments(&released, rays.centers(), 0.0, 3.0),
                Obfuscation::AxisCandidates(candidates) => {
                    let places = places(&released, candidates.position());
                    Shown::Points(places.into_iter().map(Some).collect())
                }
                Obfuscation::AxisPlanes(_) => return wrong("planes, which have no end"),
            };
            Ok((shown, released.unit()))
        }
        Stage::Recovered => {
            let recovered = read_recovered::<3>(path, None)?;
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
        let (path, unit) = (args.path.display(), unit.name());
        bail!("--scale: expected a file in meters (obfuscate --scale), found {path} in {unit}");
    }
    let divide = |point: &mut [f64; 3]| *point = point.map(|x| x / scale);
    match &mut shown {
        Shown::Points(points) => points.iter_mut().flatten().for_each(divide),
        Shown::Segments(segments) => segments.iter_mut().flatten().for_each(divide),
    }
    Ok(shown)
}

/// Returns positions of released records in the frame of the map.
fn places(released: &Released<3>, positions: &[[f32; 3]]) -> Vec<[f64; 3]> {
    let origin = released.origin();
    let place = |p: &[f32; 3]| std::array::from_fn(|c| f64::from(p[c]) + origin[c]);
    positions.iter().map(place).collect()
}

/// Returns the parts of lines or rays in a box that holds most of the hidden points, estimated from feet or centers alone: the box of
/// these without the share `left_out` at each end, extended by `around` times its width.
fn segments(released: &Released<3>, positions: &[[f32; 3]], left_out: f64, around: f64) -> Shown {
    let origin = released.origin();
    let bounds = Bounds::quantiles(&places(released, positions), left_out);
    let Bounds { low, high } = bounds.unwrap_or(Bounds { low: origin, high: origin });
    let widest = (0..3).map(|c| high[c] - low[c]).fold(0.0, f64::max);
    // All places may coincide: then extend by one unit.
    let more = if widest > 0.0 { around * widest } else { 1.0 };
    let bounds = Bounds { low: low.map(|x| x - more), high: high.map(|x| x + more) };
    Shown::Segments(record_segments(released, &bounds, 0..released.n_records()))
}
