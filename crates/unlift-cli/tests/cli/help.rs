//! Help.

use std::path::Path;

use crate::common::Place;

#[test]
fn help_is_part_of_the_interface() {
    let place = Place::empty();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/snapshots");
    let commands = ",demo,audit map,audit images,audit released,audit sequence,audit again,obfuscate,neighbors,\
                    recover,evaluate,export,table,compare,features,invert,schemes,\
                    models";
    for command in commands.split(',') {
        let (text, _) = place.ends(&format!("{command} --help"), 0);
        let name = if command.is_empty() { "unlift" } else { command }.replace(' ', "-");
        let file = folder.join(format!("{name}.txt"));
        if std::env::var_os("UPDATE_SNAPSHOTS").is_some() {
            std::fs::write(&file, &text).expect("a writable snapshot");
        }
        let kept = std::fs::read_to_string(&file).expect("a snapshot (UPDATE_SNAPSHOTS=1)");
        assert_eq!(text, kept, "{command}: UPDATE_SNAPSHOTS=1 re-blesses");
        assert!(text.lines().all(|line| line.chars().count() <= 100), "{command}");
    }
}
