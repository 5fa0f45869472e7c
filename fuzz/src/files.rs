//! Fuzz targets for readers of files.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use unlift_io::features::FeatureSource;
use unlift_io::read::{self, Input};
use unlift_io::stage::{self, ImageFile, Kind};

use super::bytes::Bytes;

/// Maximum number of images to read from a file of features, because they are similar.
const IMAGES: usize = 8;

fn folder() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    FOLDER.get_or_init(|| tempfile::tempdir().expect("a folder for files")).path()
}

fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder().join(name);
    std::fs::write(&path, bytes).expect("a file is written");
    path
}

/// Reads a point cloud. The first byte chooses the format.
pub fn points(bytes: &[u8]) {
    const NAMES: [&str; 7] =
        ["p.ply", "p.csv", "p.xyz", "p.txt", "p.npy", "points3D.bin", "points3D.txt"];
    let mut bytes = Bytes(bytes);
    let name = NAMES[usize::from(bytes.byte()) % NAMES.len()];
    let path = file(name, bytes.0);
    if let Ok(input) = read::open(&path) {
        assert!(!input.positions.is_empty() && input.positions.len() == input.ids.len());
        assert!(input.positions.iter().flatten().all(|x| x.is_finite()));
    }
}

/// Reads a COLMAP model. The first byte chooses the files and whether they are text; two bytes give
/// the length of each.
pub fn model_folder(bytes: &[u8]) {
    const NAMES: [&str; 5] = ["cameras", "images", "points3D", "rigs", "frames"];
    let mut bytes = Bytes(bytes);
    let flags = bytes.byte();
    let extension = if flags & 1 == 0 { "bin" } else { "txt" };
    let model = folder().join("model");
    let _ = std::fs::remove_dir_all(&model);
    std::fs::create_dir(&model).expect("a folder");
    for (at, name) in NAMES.into_iter().enumerate().filter(|(at, _)| flags & (2 << at) != 0) {
        let length = usize::from(bytes.short());
        let part = bytes.take(length);
        std::fs::write(model.join(name).with_extension(extension), part)
            .unwrap_or_else(|error| panic!("file {at}: {error}"));
    }
    if let Ok(input) = read::open(&model) {
        assert!(input.positions.iter().chain(&input.cameras).flatten().all(|x| x.is_finite()));
        assert!(input.ids.is_sorted());
    }
}

/// Reads descriptors of five points.
pub fn descriptors(bytes: &[u8]) {
    let input = Input {
        positions: (0..5).map(|at| [f64::from(at), 0.0, 0.0]).collect(),
        ids: (0..5).collect(),
        ..Input::default()
    };
    let path = file("d.bin", bytes);
    if let Ok(found) = read::descriptors(&path, &input) {
        assert_eq!(found.len(), 5);
    }
}

/// Reads features of images: HDF5 as hloc writes it, or COLMAP's database.
pub fn features(bytes: &[u8]) {
    let path = file("f.h5", bytes);
    let Ok(source) = FeatureSource::open(&path) else { return };
    for at in 0..source.names().len().min(IMAGES) {
        if let Ok(image) = source.get(at) {
            let n = image.keypoints.len();
            assert!(image.descriptors.is_none_or(|descriptors| descriptors.len() == n));
        }
    }
}

/// Reads a stage file as every kind.
pub fn stages(bytes: &[u8]) {
    let path = file("s.npz", bytes);
    let _ = stage::kind(&path);
    let _ = stage::scheme_name(&path);
    if let Ok(released) = stage::read_released::<3>(&path) {
        assert!(released.n_slots() >= released.n_records());
    }
    let _ = stage::read_released::<2>(&path);
    let _ = stage::read_truth::<3>(&path);
    let _ = stage::read_truth::<2>(&path);
    for (records, slots) in [(60, 1), (30, 2)] {
        if let Ok(lists) = stage::read_neighborhoods(&path, records, slots) {
            assert_eq!(lists.n_slots(), records * slots);
            assert!(lists.records().iter().all(|record| record.index() < records));
        }
    }
    let _ = stage::read_point_neighborhoods(&path, 60);
    if let Ok(recovered) = stage::read_recovered::<3>(&path, None) {
        assert!(recovered.positions().iter().flatten().all(|x| !x.is_infinite()));
    }
    let _ = stage::read_recovered::<2>(&path, None);
    if stage::has_images(&path).unwrap_or(false) {
        for kind in [Kind::Released, Kind::Truth, Kind::Neighborhoods, Kind::Recovered] {
            let Ok(mut images) = ImageFile::open(&path, kind) else { continue };
            while let Ok(Some(rows)) = images.next_image() {
                match kind {
                    Kind::Released => drop(rows.released()),
                    Kind::Truth => drop(rows.truth()),
                    Kind::Neighborhoods => drop(rows.neighborhoods(60, 1)),
                    _ => drop(rows.recovered()),
                }
            }
        }
    }
}

/// Decodes a photo.
pub fn photo(bytes: &[u8]) {
    if let Ok(image) = unlift_vision::features::photo::decode(bytes, "a photo") {
        assert!(image.width() > 0 && image.height() > 0);
        let path = file("p.jpg", bytes);
        let turn = unlift_vision::features::photo::Turn::Upright;
        let color = unlift_vision::features::photo::read_color(&path, turn);
        let (width, height) = color.expect("as it was read in gray").dimensions();
        assert_eq!([width as usize, height as usize], [image.width(), image.height()]);
    }
}

/// Reads an `audit.json`. An accepted one is written, read and written again, which must not change
/// it: the first writing rounds.
pub fn document(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(document) = unlift_report::Document::from_json(text) else { return };
    let written = document.to_json().expect("what was accepted can be written");
    let again = unlift_report::Document::from_json(&written).expect("and read");
    assert_eq!(again.to_json().expect("and written again"), written);
}

/// Loads a network of a user, whose file has no hash.
pub fn network(bytes: &[u8]) {
    let path = file("n.onnx", bytes);
    let entry = unlift_vision::network::entry("superpoint").expect("an entry");
    let _ = unlift_vision::network::Network::read(&path, entry);
}
