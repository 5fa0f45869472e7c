//! A workplace with small inputs for every command, and the content of its output folder.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

use crate::common::Place;

/// A command line in two variants that write to the same places.
#[derive(Debug)]
pub struct Case {
    /// `{}` stands for the variant: a seed, or a part of the name of an input.
    line: &'static str,
    /// True for independent files; false for one file, or files that belong together.
    pub is_each: bool,
}

const fn whole(line: &'static str) -> Case {
    Case { line, is_each: false }
}

/// Commands that write, one for each kind of output.
pub const CASES: [Case; 9] = [
    whole("obfuscate ../in/room.csv --scheme ppl --k 10 --seed {} --out out"),
    whole("obfuscate ../in/features2.h5 --scheme dcl2d --k 8 --seed {} --out out"),
    whole(
        "neighbors oracle ../in/hidden2/truth.parquet --inlier-ratio 0.5 --k 10 --seed {} \
         --out lists.parquet",
    ),
    whole(
        "recover ../in/hidden{}/released.parquet --neighbors ../in/hidden{}/lists.parquet \
         --out back.parquet",
    ),
    whole(
        "recover ../in/images{}/released.parquet --neighbors ../in/images{}/lists.parquet \
         --out back.parquet",
    ),
    whole("features ../in/photos{} --out f.h5"),
    whole(
        "audit map ../in/room.csv --k 10 --schemes olc --inlier-ratios 1 --seed {} \
         --write-clouds --out out",
    ),
    whole(
        "audit images ../in/features2.h5 --photos ../in/photos2 --invert --max-images 1 \
         --schemes lines2d --inlier-ratios 0.5 --k 8 --solver joint-start --seed {} --out out",
    ),
    Case { line: "invert ../in/photos{} --out pictures", is_each: true },
];

impl Case {
    pub fn line(&self, variant: u8) -> String {
        self.line.replace("{}", &variant.to_string())
    }
}

/// Inputs are in `in`; `work`, the working directory of runs, contains only their outputs.
pub struct Bench(Place);

/// Outputs of the undisturbed runs of a case.
pub struct Known {
    /// Output of the first variant, as an earlier run left it.
    pub old: Tree,
    pub new: Tree,
    pub took: Duration,
}

#[derive(Debug)]
pub struct Ended {
    pub code: Option<i32>,
    pub stderr: String,
}

impl Bench {
    /// Makes maps, photos, features and the outputs of the stages, each twice.
    pub fn new() -> Self {
        let bench = Self(Place::empty());
        fs::create_dir(bench.0.path("work")).unwrap();
        bench.0.write_points("in/room.csv", &unlift::synthetic::room(1, 1500).points);
        for which in [1, 2] {
            for (at, name) in ["a.png", "b/c.jpg", "d.webp"].into_iter().enumerate() {
                bench.0.write_photo(&format!("in/photos{which}/{name}"), at as u32 + 5 * which);
            }
            let (hidden, images) = (format!("../in/hidden{which}"), format!("../in/images{which}"));
            let features = format!("../in/features{which}.h5");
            let hide = format!("--seed {which} --out");
            bench.succeeds(&format!("features ../in/photos{which} --out {features}"));
            bench.succeeds(&format!("obfuscate {features} --scheme cp2d --k 8 {hide} {images}"));
            bench
                .succeeds(&format!("obfuscate ../in/room.csv --scheme ppl --k 10 {hide} {hidden}"));
            for (of, k) in [(&hidden, 10), (&images, 8)] {
                let oracle = format!("neighbors oracle {of}/truth.parquet --inlier-ratio 1");
                bench.succeeds(&format!("{oracle} --k {k} --out {of}/lists.parquet"));
            }
        }
        bench
    }

    pub fn work(&self) -> PathBuf {
        self.0.path("work")
    }

    pub fn known(&self, case: &Case) -> Known {
        let started = Instant::now();
        let [old, new] = [1, 2].map(|variant| {
            self.begin(None);
            self.succeeds(&case.line(variant));
            self.tree()
        });
        assert!(old != new, "{case:?}: two variants");
        Known { old, new, took: started.elapsed() / 2 }
    }

    /// Empties the output folder, or restores the output of an earlier run in it.
    pub fn begin(&self, earlier: Option<&Tree>) {
        fs::remove_dir_all(self.work()).unwrap();
        fs::create_dir(self.work()).unwrap();
        if let Some(earlier) = earlier {
            earlier.put(&self.work());
        }
    }

    pub fn tree(&self) -> Tree {
        Tree::of(&self.work())
    }

    /// Starts a run, in a shell that first runs `before` if given.
    pub fn start(&self, before: Option<&str>, line: &str) -> Child {
        let program = self.0.program([]);
        let mut command = match before {
            None => program,
            Some(before) => {
                let mut shell = Command::new("sh");
                let line = format!("{before} || exit 99; exec \"$0\" \"$@\"");
                shell.args(["-c", &line]).arg(program.get_program());
                shell
            }
        };
        command.args(line.split_whitespace()).current_dir(self.work()).stdin(Stdio::null());
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("the program starts")
    }

    pub fn succeeds(&self, line: &str) {
        let ended = finish(self.start(None, line));
        assert_eq!(ended.code, Some(0), "{line}: {ended:?}");
    }

    /// Checks that the next run of a case succeeds with the undisturbed output and without
    /// unfinished files.
    pub fn goes_on(&self, case: &Case, known: &Known, what: &str) {
        let ended = finish(self.start(None, &case.line(2)));
        let is_whole = ended.code == Some(0) && self.tree() == known.new;
        assert!(is_whole, "{what}: {ended:?}, {:?}", self.tree().differing(&known.new));
    }
}

pub fn finish(mut child: Child) -> Ended {
    let mut stderr = String::new();
    child.stderr.take().expect("a pipe").read_to_string(&mut stderr).expect("what was said");
    Ended { code: child.wait().expect("a state").code(), stderr }
}

/// Files below a folder by relative path, without what differs between two runs of one command.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct Tree(pub BTreeMap<String, Vec<u8>>);

impl Tree {
    /// Reads a folder, which others may be changing.
    fn of(root: &Path) -> Self {
        let (mut tree, mut waiting) = (Self::default(), vec![root.to_owned()]);
        while let Some(folder) = waiting.pop() {
            for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
                let path = entry.path();
                if path.is_dir() {
                    waiting.push(path);
                } else if let Ok(bytes) = fs::read(&path) {
                    let name = path.strip_prefix(root).unwrap().to_string_lossy().into_owned();
                    let bytes = settled(&name, bytes);
                    tree.0.insert(name, bytes);
                }
            }
        }
        tree
    }

    fn put(&self, root: &Path) {
        for (name, bytes) in &self.0 {
            let path = root.join(name);
            fs::create_dir_all(path.parent().expect("a folder")).unwrap();
            fs::write(path, bytes).unwrap();
        }
    }

    pub fn has_partial(&self) -> bool {
        self.0.keys().any(|name| name.contains(".unlift-") && name.contains(".partial"))
    }

    /// Returns the paths at which two trees differ.
    pub fn differing(&self, other: &Self) -> Vec<&str> {
        self.0.keys().filter(|&name| self.0.get(name) != other.0.get(name)).map(|s| &**s).collect()
    }
}

/// Removes the duration and the memory of a run.
fn settled(name: &str, bytes: Vec<u8>) -> Vec<u8> {
    if name.ends_with("audit.json")
        && let Ok(mut value) = serde_json::from_slice::<Value>(&bytes)
        && let Some(run) = value["run"].as_object_mut()
    {
        run.retain(|name, _| !["seconds", "peak_memory_bytes"].contains(&name.as_str()));
        return value.to_string().into_bytes();
    }
    if name.ends_with("report.html") {
        let text = String::from_utf8_lossy(&bytes);
        let (before, rest) = text.split_once("Seconds by stage.").unwrap_or((&text, ""));
        let rest = rest.split_once("</table>").map_or(rest, |(_, rest)| rest);
        let lines = before.lines().chain(rest.lines());
        let kept: Vec<&str> = lines.filter(|line| !line.contains("<dt>this run</dt>")).collect();
        return kept.join("\n").into_bytes();
    }
    bytes
}
