//! Tests which model and database of a project are found.

use std::fs;
use std::path::Path;

use unlift_io::read;

use super::data;

fn copy(from: &str, root: &Path, to: &str) {
    let to = root.join(to);
    fs::create_dir_all(&to).unwrap();
    for file in fs::read_dir(data(from)).unwrap() {
        let file = file.unwrap();
        fs::copy(file.path(), to.join(file.file_name())).unwrap();
    }
}

#[test]
fn a_project_folder_leads_to_its_model_and_database() {
    let project = data("project");
    let input = read::open(&project).unwrap();
    assert_eq!(input.ids, [2, 3, 4, 6, 9, 11]);
    assert_eq!(input.cameras.len(), 3);
    assert_eq!(input.model, Some(project.join("sparse/0")));
    assert_eq!(input.database, Some(project.join("database.db")));
    assert_eq!(input.files.len(), 3, "the classic layout: {:?}", input.files);
    let direct = read::open(&project.join("sparse/0")).unwrap();
    assert_eq!(direct.positions, input.positions);
    let alone = read::open(&project.join("sparse/0/points3D.bin")).unwrap();
    assert_eq!((&alone.positions, &alone.ids), (&input.positions, &input.ids));
}

#[test]
fn what_lies_beside_the_model_is_noted_or_ignored() {
    let dir = tempfile::tempdir().unwrap();
    for (from, to) in [("rig-bin", "sparse/0"), ("rig-txt", "sparse/0"), ("rig-bin", "sparse/1")] {
        copy(from, dir.path(), to);
    }
    fs::write(dir.path().join("sparse/0/rigs.bin"), b"\x01").unwrap();
    let input = read::open(dir.path()).unwrap();
    assert_eq!(input.format, "COLMAP binary");
    let notes = input.notes.join("\n");
    let notes = notes.replace(dir.path().to_str().unwrap(), "");
    assert_eq!(
        notes.replace('\\', "/"),
        "/sparse/0/rigs.bin: header (byte 0): expected 8 bytes of the number of rigs, \
         found 1 byte before the end of the file\n\
         points3D.txt: not read, because points3D.bin exists\n\
         sparse/0: read, the largest of 2 models (8 points)\n\
         sparse/1: another model (8 points), give its path to read it"
    );
}

#[test]
fn models_are_found_where_programs_put_them() {
    for place in [
        "",
        "0",
        "sparse",
        "sparse/0",
        "sparse/3",
        "model",
        "models/0",
        "models/2",
        "colmap",
        "colmap/sparse",
        "colmap/sparse/0",
    ] {
        for (fixture, format) in [("rig-bin", "COLMAP binary"), ("rig-txt", "COLMAP text")] {
            let dir = tempfile::tempdir().unwrap();
            copy(fixture, dir.path(), place);
            let input = read::open(dir.path()).unwrap();
            assert_eq!((input.format, input.positions.len()), (format, 8), "{place}");
            assert_eq!(input.model, Some(dir.path().join(place)), "{place}");
            assert_eq!(input.notes, [""; 0], "{place}");
        }
    }
}

#[test]
fn of_several_models_the_largest_is_read_and_told() {
    // hloc leaves models that it did not choose, and COLMAP models that it could not merge.
    let dir = tempfile::tempdir().unwrap();
    copy("project/sparse/0", dir.path(), "sparse/0");
    copy("rig-txt", dir.path(), "sparse/10");
    copy("project/sparse/0", dir.path(), "models/2");
    fs::create_dir_all(dir.path().join("sparse/11")).unwrap();
    let input = read::open(dir.path()).unwrap();
    assert_eq!((input.format, input.positions.len()), ("COLMAP text", 8));
    assert_eq!(
        input.notes,
        [
            "sparse/10: read, the largest of 3 models (8 points)",
            "sparse/0: another model (6 points), give its path to read it",
            "models/2: another model (6 points), give its path to read it",
        ]
    );
    // The folder that was named has priority, even if its model is smaller: hloc's best model is
    // there.
    copy("project/sparse/0", dir.path(), "");
    let input = read::open(dir.path()).unwrap();
    assert_eq!(input.positions.len(), 6);
    assert_eq!(
        input.notes[0],
        "the model of the folder itself: read, the first of 4 models (6 points)"
    );
}

#[test]
fn the_database_of_a_project_is_found_from_its_model_as_well() {
    for (project, model, database) in [
        ("", "sparse/0", "database.db"),
        ("", "colmap/sparse/0", "colmap/database.db"),
        ("sparse/0", "sparse/0", "database.db"),
        ("sparse", "sparse", "database.db"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        copy("project/sparse/0", dir.path(), model);
        fs::copy(data("project/database.db"), dir.path().join(database)).unwrap();
        let input = read::open(&dir.path().join(project)).unwrap();
        let found = fs::canonicalize(input.database.unwrap()).unwrap();
        assert_eq!(found, fs::canonicalize(dir.path().join(database)).unwrap(), "{model}");
    }
}
