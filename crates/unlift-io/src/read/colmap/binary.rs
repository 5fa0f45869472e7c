//! Reads COLMAP's binary files.

use std::path::Path;

use super::camera_models::CameraModel;
use super::model::{Camera, Image, Points, Tracks, place};
use crate::error::Error;
use crate::read::bytes::Bytes;

/// The smallest size of each record in bytes, which limits a declared count.
const CAMERA_BYTES: u64 = 4 + 4 + 8 + 8 + 2 * 8;
const IMAGE_BYTES: u64 = 4 + 7 * 8 + 4 + 1 + 8;
const POINT2D_BYTES: u64 = 8 + 8 + 8;
const POINT3D_BYTES: u64 = 8 + 3 * 8 + 3 + 8 + 8;
const OBSERVATION_BYTES: u64 = 4 + 4;
const RIG_BYTES: u64 = 4 + 4;
const SENSOR_BYTES: u64 = 4 + 4;
const FRAME_BYTES: u64 = 4 + 4 + 7 * 8 + 4;
const DATA_BYTES: u64 = 4 + 4 + 8;

pub fn cameras(path: &Path) -> Result<Vec<Camera>, Error> {
    let mut bytes = Bytes::open(path)?;
    let n = bytes.count("cameras", CAMERA_BYTES)?;
    let mut cameras = Vec::with_capacity(n as usize);
    for number in 1..=n {
        bytes.record(number);
        let id = bytes.u32("camera id")?;
        let model_id = bytes.i32("camera model")?;
        let Some(model) = CameraModel::from_id(model_id) else {
            let expected = format!("a camera model of COLMAP (0 to 17) for camera {id}");
            return Err(bytes.error(expected, model_id.to_string()));
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

pub fn images(path: &Path) -> Result<Vec<Image>, Error> {
    let mut bytes = Bytes::open(path)?;
    let n = bytes.count("images", IMAGE_BYTES)?;
    let mut images = Vec::with_capacity(n as usize);
    for number in 1..=n {
        bytes.record(number);
        let id = bytes.u32("image id")?;
        let rotation = bytes.doubles("rotation")?;
        let translation = bytes.doubles("translation")?;
        let (center, rotation) = place(rotation, translation);
        let camera_id = bytes.u32("camera id")?;
        let name = bytes.zero_terminated("image name")?;
        let n_points2d = bytes.count("2D points", POINT2D_BYTES)?;
        bytes.skip(n_points2d * POINT2D_BYTES, "2D points")?;
        images.push(Image { id, name, camera_id, center, rotation, n_points2d });
    }
    bytes.end()?;
    Ok(images)
}

pub fn points(path: &Path, with_tracks: bool) -> Result<Points, Error> {
    let mut bytes = Bytes::open(path)?;
    let n = bytes.count("points", POINT3D_BYTES)? as usize;
    let mut ids = Vec::with_capacity(n);
    let mut positions = Vec::with_capacity(n);
    let mut colors = Vec::with_capacity(n);
    let mut tracks = with_tracks.then(Tracks::new);
    for number in 1..=n as u64 {
        bytes.record(number);
        let id = bytes.u64("point id")?;
        let position = bytes.doubles::<3>("coordinates")?;
        let mut color = [0; 3];
        bytes.fill(&mut color, "color")?;
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
        colors.push(color);
    }
    bytes.end()?;
    Ok(Points { ids, positions, colors, tracks })
}

pub fn rigs(path: &Path) -> Result<u64, Error> {
    let mut bytes = Bytes::open(path)?;
    let n = bytes.count("rigs", RIG_BYTES)?;
    for number in 1..=n {
        bytes.record(number);
        bytes.u32("rig id")?;
        let n_sensors = bytes.count_u32("sensors", SENSOR_BYTES)?;
        for sensor in 0..n_sensors {
            bytes.skip(SENSOR_BYTES, "sensor")?;
            // The first sensor is the reference of the rig, without a pose and its flag.
            if sensor > 0 && bytes.u8("pose flag")? != 0 {
                bytes.skip(7 * 8, "sensor pose")?;
            }
        }
    }
    bytes.end()?;
    Ok(n)
}

pub fn frames(path: &Path) -> Result<u64, Error> {
    let mut bytes = Bytes::open(path)?;
    let n = bytes.count("frames", FRAME_BYTES)?;
    for number in 1..=n {
        bytes.record(number);
        bytes.u32("frame id")?;
        bytes.u32("rig id")?;
        bytes.skip(7 * 8, "pose")?;
        let n_data = bytes.count_u32("data ids", DATA_BYTES)?;
        bytes.skip(n_data * DATA_BYTES, "data ids")?;
    }
    bytes.end()?;
    Ok(n)
}
