//! Reads COLMAP models: `cameras`, `images` and `points3D`, as `.bin` or `.txt`.
//!
//! Models of COLMAP 3.12 and later also have `rigs` and `frames`, which repeat the poses of
//! `images`. They are not read.
//!
//! Source: COLMAP's documentation, "Output Format".

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use unlift::geometry::camera::{Intrinsics, Pose};

use super::bytes::Bytes;
use super::lines::{Lines, coordinates, next, number, quoted, words};
use super::map_input::pose_of;
use crate::error::Error;

/// A camera model as files store it. Audits of points do not need its projection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CameraModel {
    /// The name in text files.
    pub name: &'static str,
    /// The number of parameters.
    pub n_params: usize,
}

const fn model(name: &'static str, n_params: usize) -> CameraModel {
    CameraModel { name, n_params }
}

/// All models of COLMAP 4.2, in the order of their ids from 0.
pub const CAMERA_MODELS: [CameraModel; 18] = [
    model("SIMPLE_PINHOLE", 3),
    model("PINHOLE", 4),
    model("SIMPLE_RADIAL", 4),
    model("RADIAL", 5),
    model("OPENCV", 8),
    model("OPENCV_FISHEYE", 8),
    model("FULL_OPENCV", 12),
    model("FOV", 5),
    model("SIMPLE_RADIAL_FISHEYE", 4),
    model("RADIAL_FISHEYE", 5),
    model("THIN_PRISM_FISHEYE", 12),
    model("RAD_TAN_THIN_PRISM_FISHEYE", 16),
    model("SIMPLE_DIVISION", 4),
    model("DIVISION", 5),
    model("SIMPLE_FISHEYE", 3),
    model("FISHEYE", 4),
    model("EUCM", 6),
    model("EQUIRECTANGULAR", 2),
];

/// A camera, shared by any number of images.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// The id that images refer to.
    pub id: u32,
    /// The camera model.
    pub model: &'static CameraModel,
    /// Width of the images in pixels.
    pub width_px: u64,
    /// Height of the images in pixels.
    pub height_px: u64,
    /// The `model.n_params` parameters, in the order of COLMAP's documentation.
    pub params: Vec<f64>,
}

impl Camera {
    /// Returns focal lengths and principal point in pixels; `None` for a panorama, which has none.
    pub fn intrinsics(&self) -> Option<Intrinsics> {
        let name = self.model.name;
        if name == "EQUIRECTANGULAR" {
            return None;
        }
        let has_one_focal = name.starts_with("SIMPLE_") || name.starts_with("RADIAL");
        let n_focal = if has_one_focal { 1 } else { 2 };
        let value = |at: usize| self.params.get(at).copied();
        let focal = [value(0)?, value(n_focal - 1)?];
        let principal = [value(n_focal)?, value(n_focal + 1)?];
        let all = [focal, principal].concat();
        let usable = all.iter().all(|x| x.is_finite()) && focal.iter().all(|&f| f > 0.0);
        usable.then_some(Intrinsics { focal, principal })
    }
}

/// A registered image.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// The id that tracks refer to. A database may use other ids for the same names.
    pub id: u32,
    /// The path below the image folder, as bytes of the file. It may not be UTF-8.
    pub name: Vec<u8>,
    /// The id of its camera.
    pub camera_id: u32,
    /// The pose in units of the model. Not finite if the file has none.
    pub pose: Pose,
    /// The number of 2D points, triangulated or not.
    pub n_points2d: u64,
}

impl Image {
    /// Finds the camera of this image in `cameras`, which are sorted by id.
    pub fn camera<'a>(&self, cameras: &'a [Camera]) -> Option<&'a Camera> {
        let at = cameras.binary_search_by_key(&self.camera_id, |camera| camera.id);
        Some(&cameras[at.ok()?])
    }

    /// The unit vector in the world that points up in the photo.
    pub fn up(&self) -> [f64; 3] {
        self.pose.rotation[1].map(|x| -x)
    }
}

/// The points of a model, sorted by id.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    /// Ids `(n,)`, ascending and unique.
    pub ids: Vec<u64>,
    /// Coordinates `(n, 3)` in units of the model. Not finite if the file has no position.
    pub positions: Vec<[f64; 3]>,
    /// The observations of each point, if requested.
    pub tracks: Option<Tracks>,
}

/// The 2D points that observe each point: row `i` is `observations[offsets[i]..offsets[i + 1]]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Tracks {
    /// Offsets `(n + 1,)`, ascending from 0.
    pub offsets: Vec<usize>,
    /// Image id and index of the 2D point in that image.
    pub observations: Vec<(u32, u32)>,
}

impl Tracks {
    pub(super) fn new() -> Self {
        Self { offsets: vec![0], observations: Vec::new() }
    }

    /// Returns, for each of `images`, which of the points in `rows` it observes, as indices in
    /// `rows`, and the number of images that observe each point. An image counts once per point.
    pub fn observed(&self, images: &[Image], rows: &[u32]) -> (Vec<Vec<u32>>, Vec<u32>) {
        let by_id: BTreeMap<u32, usize> =
            images.iter().enumerate().rev().map(|(at, image)| (image.id, at)).collect();
        let mut observed = vec![Vec::new(); images.len()];
        let of_point = |(at, &row): (usize, &u32)| {
            let ids: BTreeSet<u32> = self.row(row as usize).iter().map(|(id, _)| *id).collect();
            let known = ids.iter().filter_map(|id| by_id.get(id));
            known.for_each(|&image| observed[image].push(at as u32));
            ids.len() as u32
        };
        let lengths = rows.iter().enumerate().map(of_point).collect();
        (observed, lengths)
    }

    /// Returns the observations of the point in `row`.
    ///
    /// # Panics
    /// When there is no such row.
    pub fn row(&self, row: usize) -> &[(u32, u32)] {
        &self.observations[self.offsets[row]..self.offsets[row + 1]]
    }
}

fn is_text(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("txt"))
}

/// Reads `cameras.bin` or `cameras.txt`, sorted by id.
///
/// # Errors
/// When the file is malformed, names an unknown camera model or repeats an id.
pub fn read_cameras(path: &Path) -> Result<Vec<Camera>, Error> {
    let mut cameras = if is_text(path) { text_cameras(path)? } else { binary_cameras(path)? };
    cameras.sort_by_key(|c| c.id);
    refuse_repeated(path, "camera", cameras.iter().map(|c| u64::from(c.id)))?;
    Ok(cameras)
}

/// Reads `images.bin` or `images.txt`, sorted by id.
///
/// # Errors
/// When the file is malformed, or repeats an id or a name: names lead to features.
pub fn read_images(path: &Path) -> Result<Vec<Image>, Error> {
    let mut images = if is_text(path) { text_images(path)? } else { binary_images(path)? };
    images.sort_by_key(|i| i.id);
    refuse_repeated(path, "image", images.iter().map(|i| u64::from(i.id)))?;
    let mut names: Vec<&[u8]> = images.iter().map(|image| &*image.name).collect();
    names.sort_unstable();
    if let Some(twice) = names.windows(2).find(|two| two[0] == two[1]) {
        return Err(Error::new(path, "", "each name once", format!("{} again", quoted(twice[0]))));
    }
    Ok(images)
}

/// Reads the cameras and images of the model in the folder `model`, in the form that [`super::open`] reads.
///
/// # Errors
/// When [`read_cameras`] or [`read_images`] fails, or an image names a missing camera or has no pose.
pub fn read_views(model: &Path) -> Result<(Vec<Camera>, Vec<Image>), Error> {
    let extension = if model.join("images.bin").is_file() { "bin" } else { "txt" };
    let cameras = read_cameras(&model.join(format!("cameras.{extension}")))?;
    let path = model.join(format!("images.{extension}"));
    let images = read_images(&path)?;
    for image in &images {
        let place = format!("image {}", image.id);
        if image.camera(&cameras).is_none() {
            let expected = format!("the id of a camera in cameras.{extension}");
            return Err(Error::new(path, place, expected, image.camera_id));
        }
        if image.pose.center.iter().any(|x| !x.is_finite()) {
            return Err(Error::new(path, place, "a finite pose", "none"));
        }
    }
    Ok((cameras, images))
}

/// Reads `points3D.bin` or `points3D.txt`, sorted by id. Tracks are read only if `with_tracks` is set.
///
/// # Errors
/// When the file is malformed or repeats an id.
pub fn read_points(path: &Path, with_tracks: bool) -> Result<Points, Error> {
    let read = if is_text(path) { text_points } else { binary_points };
    let points = sorted(read(path, with_tracks)?);
    refuse_repeated(path, "point", points.ids.iter().copied())?;
    Ok(points)
}

fn refuse_repeated(
    path: &Path,
    what: &str,
    ascending: impl Iterator<Item = u64> + Clone,
) -> Result<(), Error> {
    match ascending.clone().zip(ascending.skip(1)).find(|(id, next)| id == next) {
        None => Ok(()),
        Some((id, _)) => Err(Error::new(path, format!("{what} {id}"), "each id once", "it again")),
    }
}

/// Older COLMAP versions write points in the order of a hash map.
fn sorted(points: Points) -> Points {
    if points.ids.is_sorted() {
        return points;
    }
    let mut order: Vec<usize> = (0..points.ids.len()).collect();
    order.sort_by_key(|&row| points.ids[row]);
    let tracks = points.tracks.map(|tracks| {
        let mut sorted = Tracks::new();
        for &row in &order {
            sorted.observations.extend_from_slice(tracks.row(row));
            sorted.offsets.push(sorted.observations.len());
        }
        sorted
    });
    Points {
        ids: order.iter().map(|&row| points.ids[row]).collect(),
        positions: order.iter().map(|&row| points.positions[row]).collect(),
        tracks,
    }
}

/// The smallest size of each record in bytes, which limits a declared count.
const CAMERA_BYTES: u64 = 4 + 4 + 8 + 8 + 2 * 8;
const IMAGE_BYTES: u64 = 4 + 7 * 8 + 4 + 1 + 8;
const POINT2D_BYTES: u64 = 8 + 8 + 8;
const POINT3D_BYTES: u64 = 8 + 3 * 8 + 3 + 8 + 8;
const OBSERVATION_BYTES: u64 = 4 + 4;

fn binary_cameras(path: &Path) -> Result<Vec<Camera>, Error> {
    let mut bytes = Bytes::open(path)?;
    let n = bytes.count("cameras", CAMERA_BYTES)?;
    let mut cameras = Vec::with_capacity(n as usize);
    for number in 1..=n {
        bytes.record(number);
        let id = bytes.u32("camera id")?;
        let model_id = bytes.array("camera model").map(i32::from_le_bytes)?;
        let model = usize::try_from(model_id).ok().and_then(|id| CAMERA_MODELS.get(id));
        let Some(model) = model else {
            let expected = format!("a camera model of COLMAP (0 to 17) for camera {id}");
            return Err(bytes.error(expected, model_id));
        };
        let width_px = bytes.u64("width")?;
        let height_px = bytes.u64("height")?;
        let params = (0..model.n_params)
            .map(|_| Ok(bytes.doubles::<1>("a parameter")?[0]))
            .collect::<Result<_, Error>>()?;
        cameras.push(Camera { id, model, width_px, height_px, params });
    }
    bytes.end()?;
    Ok(cameras)
}

fn binary_images(path: &Path) -> Result<Vec<Image>, Error> {
    let mut bytes = Bytes::open(path)?;
    let n = bytes.count("images", IMAGE_BYTES)?;
    let mut images = Vec::with_capacity(n as usize);
    for number in 1..=n {
        bytes.record(number);
        let id = bytes.u32("image id")?;
        let rotation = bytes.doubles("rotation")?;
        let pose = pose_of(rotation, bytes.doubles("translation")?);
        let camera_id = bytes.u32("camera id")?;
        let name = bytes.zero_terminated("image name")?;
        let n_points2d = bytes.count("2D points", POINT2D_BYTES)?;
        bytes.skip(n_points2d * POINT2D_BYTES, "2D points")?;
        images.push(Image { id, name, camera_id, pose, n_points2d });
    }
    bytes.end()?;
    Ok(images)
}

fn binary_points(path: &Path, with_tracks: bool) -> Result<Points, Error> {
    let mut bytes = Bytes::open(path)?;
    let n = bytes.count("points", POINT3D_BYTES)?;
    let (mut ids, mut positions) = (Vec::with_capacity(n as usize), Vec::with_capacity(n as usize));
    let mut tracks = with_tracks.then(Tracks::new);
    for number in 1..=n {
        bytes.record(number);
        let id = bytes.u64("point id")?;
        let position = bytes.doubles::<3>("coordinates")?;
        bytes.skip(3, "color")?;
        bytes.skip(8, "reprojection error")?;
        let n_observations = bytes.count("observations", OBSERVATION_BYTES)?;
        if let Some(tracks) = &mut tracks {
            for _ in 0..n_observations {
                let image_id = bytes.u32("image id")?;
                tracks.observations.push((image_id, bytes.u32("2D point")?));
            }
            tracks.offsets.push(tracks.observations.len());
        } else {
            bytes.skip(n_observations * OBSERVATION_BYTES, "observations")?;
        }
        ids.push(id);
        positions.push(position);
    }
    bytes.end()?;
    Ok(Points { ids, positions, tracks })
}

fn text_cameras(path: &Path) -> Result<Vec<Camera>, Error> {
    let mut lines = Lines::open(path)?;
    let mut cameras = Vec::new();
    while lines.advance_to_data()? {
        let mut words = words(lines.line());
        let id = next(&lines, &mut words, "a camera id", number)?;
        let name = words.next().unwrap_or_default();
        let Some(model) = CAMERA_MODELS.iter().find(|known| known.name.as_bytes() == name) else {
            let expected = format!("a camera model of COLMAP for camera {id}");
            return Err(lines.error(expected, quoted(name)));
        };
        let width_px = next(&lines, &mut words, "a width in pixels", number)?;
        let height_px = next(&lines, &mut words, "a height in pixels", number)?;
        let params: Vec<f64> = words
            .map(|word| number(word).ok_or_else(|| lines.error("a parameter", quoted(word))))
            .collect::<Result<_, _>>()?;
        if params.len() != model.n_params {
            let expected = format!("{} parameters of {}", model.n_params, model.name);
            return Err(lines.error(expected, params.len()));
        }
        cameras.push(Camera { id, model, width_px, height_px, params });
    }
    Ok(cameras)
}

fn text_images(path: &Path) -> Result<Vec<Image>, Error> {
    let mut lines = Lines::open(path)?;
    let mut images = Vec::new();
    while lines.advance_to_data()? {
        let mut words = words(lines.line());
        let id = next(&lines, &mut words, "an image id", number)?;
        let rotation = coordinates(&lines, &mut words, "a rotation (4 numbers)")?;
        let translation = coordinates(&lines, &mut words, "a translation (3 numbers)")?;
        let pose = pose_of(rotation, translation);
        let camera_id = next(&lines, &mut words, "a camera id", number)?;
        drop(words);
        let name = after_words(lines.line(), 9).to_vec();
        if name.is_empty() {
            return Err(lines.error("an image name", "end of line"));
        }
        // The line of 2D points may be empty, and some tools omit it after the last image.
        let n_words = if lines.advance()? { self::words(lines.line()).count() } else { 0 };
        if !n_words.is_multiple_of(3) {
            let expected = "2D points of 3 numbers (x, y, point id)";
            return Err(lines.error(expected, format!("{n_words} numbers")));
        }
        images.push(Image { id, name, camera_id, pose, n_points2d: n_words as u64 / 3 });
    }
    Ok(images)
}

/// Returns the rest of a line after `n` words. Names may contain spaces.
fn after_words(mut line: &[u8], n: usize) -> &[u8] {
    for _ in 0..n {
        let end = line.iter().position(u8::is_ascii_whitespace);
        line = line[end.unwrap_or(line.len())..].trim_ascii_start();
    }
    line
}

fn text_points(path: &Path, with_tracks: bool) -> Result<Points, Error> {
    let mut lines = Lines::open(path)?;
    let mut points = Points { tracks: with_tracks.then(Tracks::new), ..Points::default() };
    while lines.advance_to_data()? {
        let mut words = words(lines.line()).peekable();
        let id: u64 = next(&lines, &mut words, "a point id", number)?;
        let position = coordinates::<3>(&lines, &mut words, "3 coordinates")?;
        coordinates::<3>(&lines, &mut words, "a color (3 numbers)")?;
        coordinates::<1>(&lines, &mut words, "a reprojection error")?;
        if let Some(tracks) = &mut points.tracks {
            while words.peek().is_some() {
                let image_id = next(&lines, &mut words, "an image id", number)?;
                let index = next(&lines, &mut words, "the index of a 2D point", number)?;
                tracks.observations.push((image_id, index));
            }
            tracks.offsets.push(tracks.observations.len());
        } else {
            let n_words = words.count();
            if !n_words.is_multiple_of(2) {
                let expected = "observations of 2 numbers (image id, 2D point)";
                return Err(lines.error(expected, format!("{n_words} numbers")));
            }
        }
        points.ids.push(id);
        points.positions.push(position);
    }
    Ok(points)
}
