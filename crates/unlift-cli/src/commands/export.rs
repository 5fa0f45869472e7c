//! `unlift export`: writes stage files of maps in formats of other programs.

use std::ffi::OsStr;

use unlift::released::Obfuscation;
use unlift::{OneLine, Unit};
use unlift_audit::{bail, check_file, refused};
use unlift_io::Error as FileError;
use unlift_io::atomic::Access;
use unlift_io::clouds::{write_cameras, write_images, write_model_points, write_points};
use unlift_io::outputs::{Kind, OutputSet, Rules};
use unlift_io::read::{self, colmap};
use unlift_io::stage::{
    Kind as Stage, has_images, kind, read_recovered, read_released, read_truth,
};

use crate::args::ExportArgs;
use crate::output::print;

/// A row per slot or original; `None` for lost points.
type Points = Vec<Option<[f64; 3]>>;

pub fn run(args: &ExportArgs) -> crate::Result<()> {
    let inputs = [Some(args.path.as_path()), args.cameras.as_deref()];
    let rules = Rules::new(inputs.into_iter().flatten(), false);
    let ending = args.out.extension().map(OsStr::to_ascii_lowercase);
    let is_cloud = ending.as_deref().is_some_and(|ending| ending == "ply");
    let out = OneLine(args.out.display());
    if args.cameras.is_some() && is_cloud {
        bail!("--cameras: expected a folder as --out, found {out}");
    }
    let n = if is_cloud {
        check_file("--out", &args.out, Kind::Cloud, &rules)?;
        let points: Vec<[f64; 3]> = points(args)?.into_iter().flatten().collect();
        write_points(&args.out, &points)?;
        format!("{} points", points.len())
    } else if ending.is_some() && !args.out.is_dir() {
        bail!(
            "--out: expected a name that ends in .ply, or a folder without an ending, found {out}"
        );
    } else {
        model(args, rules)?
    };
    print(&format!("{n}, in {out}\n"))
}

fn model(args: &ExportArgs, rules: Rules) -> crate::Result<String> {
    let names = ["cameras.txt", "images.txt", "points3D.txt"];
    let first = names.map(|name| (name, Kind::Model));
    let mut out = OutputSet::create(&args.out, rules, Access::Private, &first).map_err(refused)?;
    let points = points(args)?;
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

/// Reads the points of the file, in units of the map if `--scale` is given.
fn points(args: &ExportArgs) -> crate::Result<Points> {
    let path = &args.path;
    let kind = kind(path)?;
    let wrong = |found: &str| {
        let expected = "a released file of points, a recovered or a truth file of a map";
        Err(FileError::new(path, "", expected, found).into())
    };
    if has_images(path)? {
        return wrong("one of images");
    }
    let (mut points, unit): (Points, Unit) = match kind {
        Stage::Released => {
            let released = read_released::<3>(path)?;
            let Obfuscation::AxisCandidates(candidates) = released.obfuscation() else {
                return wrong("lines, rays or planes");
            };
            let origin = released.origin();
            let place = |p: &[f32; 3]| Some([0, 1, 2].map(|c| f64::from(p[c]) + origin[c]));
            (candidates.position().iter().map(place).collect(), released.unit())
        }
        Stage::Recovered => {
            let recovered = read_recovered::<3>(path, None)?;
            let points = (0..recovered.n_slots()).map(|slot| recovered.position(slot)).collect();
            (points, recovered.unit())
        }
        Stage::Truth => {
            let (original, _) = read_truth::<3>(path)?;
            let points = original.reveal();
            (points.positions().iter().copied().map(Some).collect(), points.unit())
        }
        Stage::Neighborhoods | Stage::PointNeighborhoods => return wrong("neighborhoods"),
    };
    if unit != Unit::Meter && (args.scale.is_some() || args.cameras.is_some()) {
        let option = if args.scale.is_some() { "--scale" } else { "--cameras" };
        let (path, unit) = (path.display(), unit.name());
        bail!("{option}: expected a file in meters (obfuscate --scale), found {path} in {unit}");
    }
    let Some(scale) = args.scale else { return Ok(points) };
    points.iter_mut().flatten().for_each(|point| *point = point.map(|x| x / scale));
    Ok(points)
}
