//! The layout of Cambridge Landmarks: `SCENE/dataset_test.txt` and `SCENE/dataset_train.txt` list
//! photos and poses, below a head of two lines: `seq1/frame00001.png X Y Z W P Q R`.

use std::collections::BTreeMap;
use std::path::Path;

use unlift_io::Error;

use super::poses::Poses;
use super::scene::Scene;
use super::text::{lines, wrong};

/// The scenes of the usual benchmark; the paper does not state which scenes it used.
pub const SCENES: [&str; 5] =
    ["KingsCollege", "OldHospital", "ShopFacade", "StMarysChurch", "GreatCourt"];

const TEST: &str = "dataset_test.txt";
const TRAIN: &str = "dataset_train.txt";
/// Words of a line: a name, a position and a quaternion.
const WORDS: usize = 8;

pub fn open(root: &Path, name: &str) -> Result<Scene, Error> {
    let folder = root.join(name);
    let mut poses = listed(&folder.join(TRAIN))?;
    let test_poses = listed(&folder.join(TEST))?;
    let n = test_poses.len();
    let there = test_poses.keys().filter(|name| folder.join(name).is_file());
    let test: Vec<String> = there.cloned().collect();
    let lacking = match test.len() {
        _ if !folder.join(TEST).is_file() => Some(format!("there is no {TEST}")),
        found if found < n => Some(format!("{found} of the {n} photos of {TEST} are there")),
        _ => None,
    };
    poses.extend(test_poses);
    Ok(Scene {
        name: name.to_owned(),
        photos: folder.clone(),
        root: folder,
        test,
        lacking,
        map: None,
        poses: Poses::Listed(poses),
    })
}

/// Reads photos and camera centers; none without the file.
fn listed(path: &Path) -> Result<BTreeMap<String, [f64; 3]>, Error> {
    let mut poses = BTreeMap::new();
    if !path.is_file() {
        return Ok(poses);
    }
    let mut is_head = true;
    for (number, line) in lines(path)? {
        let words: Vec<&str> = line.split_whitespace().collect();
        let numbers =
            words[1..].iter().map(|word| word.parse::<f64>().ok().filter(|x| x.is_finite()));
        let numbers: Option<Vec<f64>> = numbers.collect();
        match (numbers, words.len()) {
            (Some(numbers), WORDS) if !leads_out(words[0]) => {
                is_head = false;
                poses.insert(words[0].to_owned(), [numbers[0], numbers[1], numbers[2]]);
            }
            // The first lines describe the columns.
            _ if is_head && number <= 3 => {}
            _ => return Err(wrong(path, number, "a photo, X Y Z and W P Q R", &line)),
        }
    }
    Ok(poses)
}

fn leads_out(name: &str) -> bool {
    let inside = |part| matches!(part, std::path::Component::Normal(_));
    !Path::new(name).components().all(inside)
}
