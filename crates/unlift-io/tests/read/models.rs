//! Tests the files of a COLMAP model, binary and text.

use std::fs;
use std::path::Path;

use unlift_io::read::{self, colmap};

use super::{close, data, total, write};

#[test]
fn binary_and_text_models_are_equal() {
    let (bin, txt) = (data("rig-bin"), data("rig-txt"));
    let file = |folder: &Path, name: &str, e: &str| folder.join(format!("{name}.{e}"));
    let cameras = colmap::read_cameras(&file(&bin, "cameras", "bin")).unwrap();
    assert_eq!(cameras, colmap::read_cameras(&file(&txt, "cameras", "txt")).unwrap());
    let ids: Vec<i32> = cameras.iter().map(|c| c.model.id).collect();
    assert_eq!(ids, (0..18).collect::<Vec<_>>(), "one camera of every model");

    let images = colmap::read_images(&file(&bin, "images", "bin")).unwrap();
    assert_eq!(images, colmap::read_images(&file(&txt, "images", "txt")).unwrap());
    assert_eq!(images[0].name, "küche/ä 0.jpg".as_bytes());
    assert_eq!(images[0].n_points2d, 4);

    let points = colmap::read_points(&file(&bin, "points3D", "bin"), true).unwrap();
    let same = colmap::read_points(&file(&txt, "points3D", "txt"), true).unwrap();
    assert_eq!(points, same);
    assert_eq!(points.ids, [1, 3, 5, 7, 12, 44, 900, 1 << 40]);
    assert_eq!(points.tracks.unwrap().row(1), [(2, 1), (3, 0), (4, 0)]);

    for (folder, extension) in [(&bin, "bin"), (&txt, "txt")] {
        let rigs = colmap::check_rigs(&file(folder, "rigs", extension));
        let frames = colmap::check_frames(&file(folder, "frames", extension));
        assert_eq!((rigs.unwrap(), frames.unwrap()), (17, 18));
    }
}

#[test]
fn model_folders_open_with_centers_ids_and_files() {
    let bin = read::open(&data("rig-bin")).unwrap();
    let txt = read::open(&data("rig-txt")).unwrap();
    assert_eq!(bin.positions, txt.positions);
    assert_eq!(bin.cameras, txt.cameras);
    assert_eq!((bin.format, txt.format), ("COLMAP binary", "COLMAP text"));
    assert_eq!((bin.files.len(), txt.files.len()), (5, 5));
    assert_eq!((&bin.notes, &txt.notes), (&vec![], &vec![]));
    assert_eq!((bin.database, bin.positions.len()), (None, 8));
    // pycolmap: `image.projection_center()` of image 20, the last; the sum of `point3D.xyz`.
    let center = [-0.18425494062287595, 0.11058267526290974, 0.11110621415901362];
    close(*bin.cameras.last().unwrap(), center, 1e-12);
    let sum = [-14.46619668331794, -9.942024018235283, -17.581669871119047];
    close(total(&bin.positions), sum, 1e-12);
}

#[test]
fn names_need_not_be_utf8() {
    let bytes = fs::read(data("project/sparse/0/images.bin")).unwrap();
    let name = "küche/ä 0.jpg".as_bytes();
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap();
    let mut bytes = bytes;
    bytes[at] = 0xff;
    let (_dir, path) = write("images.bin", bytes);
    let images = colmap::read_images(&path).unwrap();
    assert_eq!(images[0].name[0], 0xff);
}

#[test]
fn text_models_may_have_no_2d_points_and_windows_line_ends() {
    let text = "# c\r\n1 1 0 0 0 1 2 3 1 a b.jpg\r\n\r\n2 1 0 0 0 4 5 6 1 c.jpg\r\n";
    let (_dir, path) = write("images.txt", text);
    let images = colmap::read_images(&path).unwrap();
    assert_eq!(images[0].name, b"a b.jpg");
    assert_eq!(images[0].center, [-1.0, -2.0, -3.0]);
    assert_eq!((images[1].name.as_slice(), images[1].n_points2d), (&b"c.jpg"[..], 0));
}
