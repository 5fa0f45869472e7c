//! The layout of 7-Scenes: `SCENE/TestSplit.txt` names sequences, whose frames are
//! `SCENE/seq-01/frame-000000.color.png`.

use std::path::Path;

use unlift_io::Error;

use super::poses::Poses;
use super::scene::Scene;
use super::text::{files, lines, wrong};

/// The scenes in the order of the paper's figures, which is that of the dataset's page.
pub const SCENES: [&str; 7] =
    ["chess", "fire", "heads", "office", "pumpkin", "redkitchen", "stairs"];

const SPLIT: &str = "TestSplit.txt";

pub fn open(root: &Path, name: &str) -> Result<Scene, Error> {
    let folder = root.join(name);
    let split = folder.join(SPLIT);
    let (mut test, mut lacking) = (Vec::new(), None);
    if split.is_file() {
        for (number, line) in lines(&split)? {
            let sequence = line.strip_prefix("sequence").and_then(|n| n.parse::<u32>().ok());
            let sequence = sequence.ok_or_else(|| wrong(&split, number, "sequenceN", &line))?;
            let sequence = format!("seq-{sequence:02}");
            let place = folder.join(&sequence);
            if place.is_dir() {
                let frames = files(&place, ".color.png")?;
                test.extend(frames.into_iter().map(|frame| format!("{sequence}/{frame}")));
            } else if place.with_extension("zip").is_file() {
                lacking = Some(format!("{sequence} is still packed (unzip {sequence}.zip)"));
            } else {
                lacking = Some(format!("there is no folder {sequence}"));
            }
        }
    } else {
        lacking = Some(format!("there is no {SPLIT}"));
    }
    test.sort_unstable();
    Ok(Scene {
        name: name.to_owned(),
        photos: folder.clone(),
        poses: Poses::Beside(folder.clone()),
        root: folder,
        test,
        lacking,
        map: None,
    })
}
