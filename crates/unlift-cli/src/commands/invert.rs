//! `unlift invert`: paints pictures from keypoints, recovered keypoints, a recovered map, or bearings.

use std::io::Write;
use std::num::NonZeroUsize;
use std::path::{Component, Path, PathBuf};

use rayon::prelude::*;
use unlift::OneLine;
use unlift::recover::Recovered;
use unlift::released::Released;
use unlift_audit::images::{FeatureSource, Wanted, evenly, kind_of};
use unlift_audit::inversion::view;
use unlift_audit::released::same_map;
use unlift_audit::{bail, refused};
use unlift_io::Error as FileError;
use unlift_io::atomic::{Access, make_folders, write_file};
use unlift_io::outputs::{Kind, OutputSet, Rules, marked_picture};
use unlift_io::read::colmap;
use unlift_io::stage::{
    ImageFile, Kind as Stage, declared_kind, has_images, read_recovered, read_released,
};
use unlift_vision::features::{ColorImage, photo};
use unlift_vision::network::DescriptorKind;
use unlift_vision::pictures::{Painter, on_bearings, six_views};

use super::common::all_could_be;
use super::stages::{self, of_image};
use crate::Error;
use crate::args::InvertArgs;
use crate::output::{print, tell};

pub fn run(args: &InvertArgs) -> crate::Result<()> {
    let inputs = [Some(&args.path), args.recovered.as_ref(), args.cameras.as_ref()];
    let rules = Rules::new(inputs.into_iter().flatten().map(PathBuf::as_path), false);
    // Only checks that files can be written there.
    drop(OutputSet::create(&args.out, rules.clone(), Access::Private, &[]).map_err(refused)?);
    let to = Target { args, rules };
    let results = match (&args.recovered, declared_kind(&args.path)) {
        (Some(recovered), _) if has_images(&args.path)? => images(&to, recovered)?,
        (Some(recovered), _) => map(&to, recovered)?,
        (None, Some(Stage::Released)) => {
            let map = if has_images(&args.path)? { None } else { Some(read_released(&args.path)?) };
            match map.filter(|released| released.obfuscation().is_bearings()) {
                Some(released) => bearings(&to, &released)?,
                None => bail!("RECOVERED: expected what came back of PATH, found none"),
            }
        }
        (None, _) => keypoints(&to)?,
    };
    let failed: Vec<&Error> = results.iter().filter_map(|result| result.as_ref().err()).collect();
    failed.iter().for_each(|error| tell(format_args!("unlift: {error}")));
    let painted = results.len() - failed.len();
    print(&format!("{painted} pictures, in {}\n", OneLine(args.out.display())))?;
    all_could_be("painted", &args.path, painted, failed.len())
}

/// The result of each image.
type Painted = Vec<crate::Result<()>>;

struct Target<'a> {
    args: &'a InvertArgs,
    rules: Rules,
}

impl Target<'_> {
    /// Writes the picture of image `name`, which may contain folders.
    fn add(&self, name: &str, picture: &ColorImage) -> crate::Result<()> {
        let relative = Path::new(name);
        let within = relative.components().all(|part| matches!(part, Component::Normal(_)));
        if !within || name.is_empty() {
            let (expected, found) = ("a name within a folder", format!("{name:?}"));
            return Err(FileError::new(&self.args.path, "image", expected, found).into());
        }
        // Append to the whole name, because `a.jpg` and `a.png` may be two images.
        let file = self.args.out.join(relative).with_added_extension("png");
        if let Some(folder) = file.parent() {
            make_folders(folder, Access::Private)?;
        }
        let file = self.rules.check(&file, Kind::Picture)?;
        let bytes = marked_picture(&photo::png_of(picture)?);
        Ok(write_file(&file, Access::Private, |out| out.write_all(&bytes))?)
    }

    /// Returns the indices of the images to paint, out of `n`.
    fn chosen(&self, n: usize) -> Vec<usize> {
        evenly(n, self.args.max_images.map(NonZeroUsize::get))
    }
}

/// Paints all images in parallel.
fn each<T: Sync>(
    to: &Target<'_>,
    images: &[T],
    paint: impl Fn(&T) -> crate::Result<(String, ColorImage)> + Sync,
) -> Painted {
    let work = |image: &T| paint(image).and_then(|(name, picture)| to.add(&name, &picture));
    images.par_iter().with_max_len(1).map(work).collect()
}

/// Paints from the keypoints of photos or of a file.
fn keypoints(to: &Target<'_>) -> crate::Result<Painted> {
    let path = &to.args.path;
    let wanted = Wanted { option: "--features", kind: to.args.features, ..Wanted::default() };
    let source = FeatureSource::open(path, &wanted.extraction(path)?)?;
    let chosen = to.chosen(source.names.len());
    // Errors of single images are reported when they are painted.
    let kind = source.kind("PATH", &chosen)?;
    let painter = &Painter::open(kind, None)?;
    Ok(each(to, &chosen, |&at| {
        let image = source.get(at)?;
        let descriptors = image.described(path)?;
        let size = image.size.ok_or_else(|| {
            let place = format!("image {}", image.name);
            FileError::new(path, place, "a size in pixels", "none")
        })?;
        let places: Vec<[f32; 2]> =
            image.keypoints.iter().map(|place| place.map(|x| x as f32)).collect();
        let size = size.map(|side| side as usize);
        let picture = painter.keypoints(&places, descriptors, size);
        let picture = picture.map_err(of_image(path, &image.name))?;
        Ok((image.name, picture))
    }))
}

/// Returns the descriptor kind of the first released image that has descriptors.
fn kind_of_images(path: &Path) -> crate::Result<DescriptorKind> {
    let mut released = ImageFile::open(path, Stage::Released)?;
    while let Some(rows) = released.next_image()? {
        let image = rows.released()?;
        if image.n_slots() > 0 {
            return kind_of("PATH", image.descriptors());
        }
    }
    kind_of("PATH", None)
}

/// Paints from the recovered keypoints of released images.
fn images(to: &Target<'_>, recovered: &Path) -> crate::Result<Painted> {
    let path = &to.args.path;
    let painter = &Painter::open(kind_of_images(path)?, None)?;
    let mut released = ImageFile::open(path, Stage::Released)?;
    let mut recovered_file = ImageFile::open(recovered, Stage::Recovered)?;
    let mut left = to.args.max_images.map_or(usize::MAX, NonZeroUsize::get);
    let next = || {
        if left == 0 {
            return Ok(None);
        }
        left -= 1;
        let Some(rows) = released.next_image()? else {
            recovered_file.expect_end(path)?;
            return Ok(None);
        };
        let name = rows.name().to_owned();
        let image = rows.released()?;
        let came_back = recovered_file.expect(&name, path)?.recovered()?;
        same_map(recovered, came_back.about().map, path, Some(image.fingerprint()))?;
        Ok(Some((name, image, came_back)))
    };
    let work = |(name, released, recovered): (String, Released<2>, Recovered<2>)| {
        let picture = painter.image(&released, &recovered).map_err(of_image(path, &name));
        Ok(picture.map_err(Into::into).and_then(|picture| to.add(&name, &picture)))
    };
    let mut results = Vec::new();
    stages::each(next, work, |result| {
        results.push(result);
        Ok(())
    })?;
    Ok(results)
}

/// Paints from the recovered points of a map, as the cameras of a model see them.
fn map(to: &Target<'_>, recovered: &Path) -> crate::Result<Painted> {
    let (args, path) = (to.args, &to.args.path);
    let Some(model) = &args.cameras else {
        bail!("--cameras: expected a COLMAP model whose cameras see the map, found none");
    };
    let scale = args.scale.unwrap_or(1.0);
    let released = read_released::<3>(path)?;
    let painter = Painter::open(kind_of("PATH", released.descriptors())?, None)?;
    let came_back = read_recovered::<3>(recovered, None)?;
    same_map(recovered, came_back.about().map, path, Some(released.fingerprint()))?;
    let (cameras, mut images) = colmap::read_views(model)?;
    images.sort_by(|a, b| a.name.cmp(&b.name));
    let chosen = to.chosen(images.len());
    Ok(each(to, &chosen, |&at| {
        let image = &images[at];
        let name = String::from_utf8_lossy(&image.name).into_owned();
        let camera = image.camera(&cameras).expect("checked when the model is read");
        let of_image = of_image(model, &name);
        let view = view(camera, image, scale).map_err(&of_image)?;
        if !painter.sees(&view, &came_back).map_err(&of_image)? {
            let error = unlift::Error::new("recovered points", "some before the camera", "none");
            return Err(of_image(error).into());
        }
        let picture = painter.map(&view, &released, &came_back).map_err(of_image)?;
        Ok((name, picture))
    }))
}

/// Paints six views from the center of bearings, such as a sphere cloud: directions are released, so nothing needs to be recovered.
fn bearings(to: &Target<'_>, released: &Released<3>) -> crate::Result<Painted> {
    let of_map = |error| FileError::core(&to.args.path, error);
    let painter = Painter::open(kind_of("PATH", released.descriptors())?, None)?;
    let places = on_bearings(released).map_err(of_map)?;
    Ok(each(to, &six_views(released).map_err(of_map)?, |(name, view)| {
        Ok(((*name).to_owned(), painter.map(view, released, &places).map_err(of_map)?))
    }))
}
