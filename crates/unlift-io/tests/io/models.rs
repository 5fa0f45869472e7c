//! Tests COLMAP models, binary and text, and where they are found.

use std::fs;

use unlift_io::read::{self, colmap};

use super::{close, copy_folder, data, fixture, total, write};

#[test]
fn binary_and_text_models_are_equal() {
    let [bin, txt] = [("rig-bin", "bin"), ("rig-txt", "txt")].map(|(folder, extension)| {
        let file = |name: &str| data(folder).join(format!("{name}.{extension}"));
        let cameras = colmap::read_cameras(&file("cameras")).unwrap();
        let images = colmap::read_images(&file("images")).unwrap();
        (cameras, images, colmap::read_points(&file("points3D"), true).unwrap())
    });
    assert_eq!(bin, txt);
    let (cameras, images, points) = bin;
    let models: Vec<_> = cameras.iter().map(|camera| *camera.model).collect();
    assert_eq!(models, colmap::CAMERA_MODELS, "one camera of every model");
    assert_eq!((&*images[0].name, images[0].n_points2d), ("küche/ä 0.jpg".as_bytes(), 4));
    assert_eq!(points.ids, [1, 3, 5, 7, 12, 44, 900, 1 << 40]);
    assert_eq!(points.tracks.unwrap().row(1), [(2, 1), (3, 0), (4, 0)]);
}

#[test]
fn model_folders_open_with_centers_ids_and_files() {
    for (name, format) in [("rig-bin", "COLMAP binary"), ("rig-txt", "COLMAP text")] {
        let map = read::open(&data(name)).unwrap();
        assert_eq!((map.format, map.positions.len(), map.notes.len()), (format, 8, 0));
        assert_eq!((map.files.len(), map.beside.len()), (3, 0), "without rigs and frames");
        // pycolmap: `image.projection_center()` of image 20, the last; the sum of `point3D.xyz`.
        let center = [-0.18425494062287595, 0.11058267526290974, 0.11110621415901362];
        close(*map.cameras.last().unwrap(), center, 1e-12);
        let sum = [-14.46619668331794, -9.942024018235283, -17.581669871119047];
        close(total(&map.positions), sum, 1e-12);
    }
    let dir = tempfile::tempdir().unwrap();
    copy_folder(&data("rig-txt"), dir.path());
    fs::rename(dir.path().join("points3D.txt"), dir.path().join("unused.txt")).unwrap();
    fs::copy(data("cloud.ply"), dir.path().join("points3D.ply")).unwrap();
    let map = read::open(dir.path()).unwrap();
    assert_eq!((map.positions.len(), map.cameras.len()), (8, 20));
    assert_eq!(map.notes, ["points3D.ply: read (no points3D.bin, no points3D.txt)"]);
    let alone = read::open(&data("rig-bin/points3D.bin")).unwrap();
    assert_eq!(alone.positions, read::open(&data("rig-bin")).unwrap().positions);
}

#[test]
fn names_need_not_be_utf8_and_text_may_have_windows_line_ends_and_no_2d_points() {
    let mut bytes = fixture("project/sparse/0/images.bin");
    let name = "küche/ä 0.jpg".as_bytes();
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap();
    bytes[at] = 0xff;
    let (_dir, path) = write("images.bin", bytes);
    assert_eq!(colmap::read_images(&path).unwrap()[0].name[0], 0xff);
    let text = "# c\r\n1 1 0 0 0 1 2 3 1 a b.jpg\r\n\r\n2 1 0 0 0 4 5 6 1 c.jpg\r\n";
    let (_dir, path) = write("images.txt", text);
    let images = colmap::read_images(&path).unwrap();
    let numbers = |image: &colmap::Image| (image.pose.center, image.n_points2d);
    assert_eq!((&images[0].name[..], &images[1].name[..]), (&b"a b.jpg"[..], &b"c.jpg"[..]));
    assert_eq!(numbers(&images[0]), ([-1.0, -2.0, -3.0], 0));
    assert_eq!(numbers(&images[1]), ([-4.0, -5.0, -6.0], 0));
}

/// Older COLMAP versions write points in the order of a hash map.
#[test]
fn unsorted_points_are_sorted_with_their_tracks() {
    let text = "7 7 7 7 0 0 0 0 7 0 7 1\n2 2 2 2 0 0 0 0 2 0\n";
    let (_dir, path) = write("points3D.txt", text);
    let points = colmap::read_points(&path, true).unwrap();
    assert_eq!((points.ids, points.positions), (vec![2, 7], vec![[2.0; 3], [7.0; 3]]));
    let tracks = points.tracks.unwrap();
    assert_eq!((tracks.row(0), tracks.row(1)), (&[(2, 0)][..], &[(7, 0), (7, 1)][..]));
}

#[test]
fn models_are_found_where_programs_put_them() {
    let places = ",0,sparse,sparse/0,sparse/3,model,models/0,models/2,colmap,colmap/sparse,colmap/sparse/0,\
                  dslr_calibration_undistorted";
    // Models of undistorted images are read where there is no other.
    let undistorted = ["dense/0/sparse", "dense/sparse"];
    for place in places.split(',').chain(undistorted) {
        let dir = tempfile::tempdir().unwrap();
        copy_folder(&data("rig-txt"), &dir.path().join(place));
        let input = read::open(dir.path()).unwrap();
        assert_eq!((input.positions.len(), input.notes.len()), (8, 0), "{place}");
        assert_eq!(input.model, Some(dir.path().join(place)));
        if undistorted.contains(&place) {
            copy_folder(&data("project/sparse/0"), &dir.path().join("sparse/0"));
            let input = read::open(dir.path()).unwrap();
            assert_eq!((input.model, input.notes), (Some(dir.path().join("sparse/0")), vec![]));
        }
    }
}

/// hloc leaves models that it did not choose, and COLMAP models that it could not merge.
#[test]
#[rustfmt::skip] // One row per line.
fn of_several_models_the_largest_is_read_and_the_others_are_noted() {
    let [small, large, bin] = ["project/sparse/0", "rig-txt", "rig-bin"].map(data);
    for (models, format, notes) in [
        ([(&bin, "sparse/0"), (&large, "sparse/0"), (&bin, "sparse/1")], "COLMAP binary", [
            "points3D.txt: not read, because points3D.bin exists",
            "sparse/0: read, the largest of 2 models (8 points)",
            "sparse/1: another model (8 points), give its path to read it",
        ]),
        ([(&small, "sparse/0"), (&large, "sparse/10"), (&small, "models/2")], "COLMAP text", [
            "sparse/10: read, the largest of 3 models (8 points)",
            "sparse/0: another model (6 points), give its path to read it",
            "models/2: another model (6 points), give its path to read it",
        ]),
    ] {
        let dir = tempfile::tempdir().unwrap();
        fs::create_dir_all(dir.path().join("sparse/11")).unwrap();
        models.iter().for_each(|(from, to)| copy_folder(from, &dir.path().join(to)));
        let input = read::open(dir.path()).unwrap();
        assert_eq!((input.format, input.positions.len()), (format, 8));
        let told = input.notes.join("\n").replace(dir.path().to_str().unwrap(), "");
        assert_eq!(told.replace('\\', "/"), notes.join("\n"));
        // The folder that was named has priority, even if its model is smaller: hloc's best model is there.
        copy_folder(&small, dir.path());
        let input = read::open(dir.path()).unwrap();
        assert_eq!(input.positions.len(), 6);
        let told = "the model of the folder itself: read, the first of ";
        assert!(input.notes.iter().any(|note| note.starts_with(told)), "{:?}", input.notes);
    }
}

#[test]
fn descriptors_of_a_project_are_found_from_its_model_as_well() {
    for (project, model, database) in [
        ("", "sparse/0", "database.db"),
        ("", "colmap/sparse/0", "colmap/database.db"),
        ("sparse/0", "sparse/0", "database.db"),
        ("sparse", "sparse", "database.db"),
        ("sfm", "sfm", "feats-superpoint-n4096-r1024.h5"),
        ("", "sparse", "features.h5"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        copy_folder(&data("project/sparse/0"), &dir.path().join(model));
        fs::copy(data("project/database.db"), dir.path().join(database)).unwrap();
        fs::write(dir.path().join("feats-superpoint_matches-superglue.h5"), "").unwrap();
        let input = read::open(&dir.path().join(project)).unwrap();
        let [found] = &input.beside[..] else { panic!("{model}: {:?}", input.beside) };
        let expected = fs::canonicalize(dir.path().join(database)).unwrap();
        assert_eq!(fs::canonicalize(found).unwrap(), expected, "{model}");
    }
}

#[test]
#[rustfmt::skip] // One row per line.
fn cameras_are_not_needed_for_points() {
    for (file, from, to, note) in [
        ("cameras.txt", "SIMPLE_PINHOLE", "SPHERICAL", "expected a camera model of COLMAP for camera"),
        ("cameras.txt", "\n1 SIMPLE_PINHOLE", "\n99 SIMPLE_PINHOLE", "2 of 20 images name a camera that is not in cameras.txt"),
        // A pose with NaN, and one of zeros.
        ("images.txt", "\n3 0.2448454332437206 ", "\n3 nan ", "1 of 20 cameras have no place"),
        ("images.txt", "\n2 0.69121825575770734 0.46875053236901132 0.54926565388881932 -0.028240091521257206", "\n2 0 0 0 0", "1 of 20 cameras have no place"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        for name in ["cameras.txt", "images.txt", "points3D.txt"] {
            let text = fs::read_to_string(data("rig-txt").join(name)).unwrap();
            let text = if name == file { text.replace(from, to) } else { text };
            fs::write(dir.path().join(name), text).unwrap();
        }
        let input = read::open(dir.path()).unwrap();
        assert_eq!((input.positions.len(), input.cameras.len() + input.n_unplaced), (8, 20));
        assert!(input.notes.len() == 1 && input.notes[0].contains(note), "{:?}", input.notes);
    }
}

#[test]
fn what_other_programs_write_is_read_or_gets_a_line_that_helps() {
    let dir = tempfile::tempdir().unwrap();
    for (inside, told) in [
        ("predictions.npz", "predictions of VGGT: give its COLMAP folder"),
        ("map.ply.gz", "gunzip"),
        ("splats/point_cloud/iteration_7/point_cloud.ply", "give point_cloud/iteration_*"),
        ("project/MeshroomCache/Meshing/1", "aliceVision_exportColmap"),
        ("cache/StructureFromMotion/1", "aliceVision_exportColmap"),
    ] {
        let file = dir.path().join(inside);
        fs::create_dir_all(file.parent().unwrap()).unwrap();
        fs::write(file, "x").unwrap();
        let given = dir.path().join(inside.split('/').next().unwrap());
        let error = read::open(&given).unwrap_err().to_string();
        assert!(error.contains(told) && !error.contains('\n'), "{error}");
    }
}
