//! The layout of 12-Scenes: `apt1/kitchen/split.txt` has a line per sequence, of which the first is
//! the test split. All frames are `apt1/kitchen/data/frame-000000.color.jpg`, one sequence after
//! the other.

use std::path::Path;

use unlift_io::Error;

use super::poses::Poses;
use super::scene::Scene;
use super::text::{files, lines, wrong};

/// The scenes, named as in the dataset's archives.
pub const SCENES: [&str; 12] = [
    "apt1/kitchen",
    "apt1/living",
    "apt2/bed",
    "apt2/kitchen",
    "apt2/living",
    "apt2/luke",
    "office1/gates362",
    "office1/gates381",
    "office1/lounge",
    "office1/manolis",
    "office2/5a",
    "office2/5b",
];

const SPLIT: &str = "split.txt";
const FRAME: &str = "frame-";
const PHOTO: &str = ".color.jpg";

pub fn open(root: &Path, name: &str) -> Result<Scene, Error> {
    let folder = root.join(name);
    let (split, photos) = (folder.join(SPLIT), folder.join("data"));
    let (mut test, mut lacking) = (Vec::new(), None);
    if !split.is_file() {
        lacking = Some(format!("there is no {SPLIT}"));
    } else if !photos.is_dir() {
        lacking = Some("there is no folder data".to_owned());
    } else {
        let n = test_frames(&split)?;
        let number = |name: &str| name.strip_prefix(FRAME)?.strip_suffix(PHOTO)?.parse().ok();
        let of_test = |name: &String| number(name).is_some_and(|at: u64| at < n);
        test = files(&photos, PHOTO)?.into_iter().filter(of_test).collect();
        if test.is_empty() {
            lacking =
                Some(format!("there is no photo {FRAME}000000{PHOTO} to {FRAME}{:06}", n - 1));
        }
    }
    let poses = Poses::Beside(photos.clone());
    Ok(Scene { name: name.to_owned(), root: folder, photos, test, lacking, map: None, poses })
}

/// Reads the number of frames of the first sequence: `sequence0 [frames=357] [start=0 ; end=356]`.
fn test_frames(split: &Path) -> Result<u64, Error> {
    let lines = lines(split)?;
    let (number, line) = lines.first().map_or((1, ""), |(number, line)| (*number, line));
    let frames = line.split_once("[frames=").and_then(|(_, rest)| rest.split_once(']'));
    let frames = frames.and_then(|(frames, _)| frames.trim().parse::<u64>().ok());
    let expected = "a first sequence as sequence0 [frames=N] ..";
    frames.filter(|&n| n > 0).ok_or_else(|| wrong(split, number, expected, line))
}
