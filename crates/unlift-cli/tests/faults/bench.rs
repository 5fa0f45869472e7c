//! A workplace with small inputs for every command, and runs in a folder of their own.

use std::collections::{BTreeSet, HashMap};
use std::fs;
use std::io::Read;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::commands::{Case, Writes};
use crate::common::Place;
use crate::full;
use crate::tree::{Tree, differing};

const POINTS: usize = 1500;
/// A run that takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(3600);

/// Inputs are in `in`; `work`, the working directory of runs, contains only their outputs.
pub struct Bench {
    place: Place,
    inputs: &'static Tree,
}

static NONE: Tree = Tree::new();
static INPUTS: OnceLock<Tree> = OnceLock::new();
/// Undisturbed results by the name of the case, computed once for all tests.
static KNOWN: Mutex<Option<HashMap<&str, Arc<Known>>>> = Mutex::new(None);

/// Outputs of the undisturbed runs of a case.
pub struct Known {
    pub new: Tree,
    /// Output of the earlier run.
    pub old: Tree,
    pub took: Duration,
}

#[derive(Debug)]
pub struct Ended {
    pub code: Option<i32>,
    pub signal: Option<i32>,
    pub stderr: String,
}

impl Bench {
    pub fn new() -> Self {
        let place = Place::empty();
        fs::create_dir(place.path("work")).unwrap();
        let bench = Self { place, inputs: INPUTS.get_or_init(inputs) };
        bench.restore_inputs();
        bench
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.place.path(name)
    }

    /// Returns the undisturbed results of a case; only the full version runs slow cases.
    pub fn known(&self, case: &'static Case) -> Arc<Known> {
        // Results stay valid if another test failed.
        let mut all = KNOWN.lock().unwrap_or_else(PoisonError::into_inner);
        let all = all.get_or_insert_default();
        if let Some(known) = all.get(case.name) {
            return Arc::clone(known);
        }
        let of = |line: &str| {
            self.begin(None);
            let started = Instant::now();
            self.succeeds(line);
            (self.tree(), started.elapsed())
        };
        let (old, took) = of(&case.earlier());
        let known = match case.is_slow && !full() {
            true => Known { new: Tree::default(), old, took },
            false => {
                let (new, took) = of(&case.line());
                Known { new, old, took }
            }
        };
        let are_two = known.new != known.old;
        assert_eq!(are_two, case.writes != Writes::Nothing, "{}: two variants", case.name);
        let known = Arc::new(known);
        all.insert(case.name, Arc::clone(&known));
        known
    }

    /// Empties the output folder, or restores the output of an earlier run in it.
    pub fn begin(&self, earlier: Option<&Tree>) {
        fs::remove_dir_all(self.path("work")).unwrap();
        fs::create_dir(self.path("work")).unwrap();
        if let Some(earlier) = earlier {
            earlier.put(&self.path("work"));
        }
    }

    pub fn restore_inputs(&self) {
        let _ = fs::remove_dir_all(self.path("in"));
        self.inputs.put(&self.path("in"));
    }

    pub fn inputs_are_whole(&self) -> bool {
        Tree::of(&self.path("in")) == *self.inputs
    }

    /// Returns the output folder of a run that ended.
    pub fn tree(&self) -> Tree {
        Tree::of(&self.path("work")).settled()
    }

    /// Starts a run, in a shell that first runs `before` if given.
    pub fn start(&self, before: Option<&str>, line: &str) -> Child {
        let program = self.place.program([]);
        let mut command = match before {
            None => program,
            Some(before) => {
                let mut shell = Command::new("sh");
                // A core dump is no output.
                shell.args(["-c", &format!("ulimit -c 0; {before}")]).arg(program.get_program());
                shell
            }
        };
        command
            .args(line.split_whitespace())
            .current_dir(self.path("work"))
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts")
    }

    pub fn run(&self, before: Option<&str>, line: &str) -> Ended {
        finish(self.start(before, line), line)
    }

    pub fn succeeds(&self, line: &str) -> Ended {
        let ended = self.run(None, line);
        assert_eq!(ended.code, Some(0), "{line}: {ended:?}");
        ended
    }

    /// Plants unfinished files of a dead run wherever this case may leave some.
    fn plant(&self, case: &Case, output: &Tree) {
        let files = output.names().filter(|name| !name.ends_with('/'));
        let folders: BTreeSet<&str> = files
            .map(|name| match case.writes {
                Writes::Each => name.rsplit_once('/'),
                // Files that belong together are built in one folder.
                Writes::Nothing | Writes::Whole => name.split_once('/'),
            })
            .map(|parts| parts.map_or("", |(folder, _)| folder))
            .collect();
        for folder in folders {
            let folder = self.path("work").join(folder);
            fs::create_dir_all(&folder).unwrap();
            fs::write(folder.join(".x.unlift-0aZ9xy.partial"), "half").unwrap();
        }
    }

    /// Checks that the next run of a case succeeds with the undisturbed output and without
    /// unfinished files. After a slow case the next run is its quick variant, at the same place.
    pub fn goes_on(&self, case: &'static Case, what: &str) {
        let known = self.known(case);
        let (line, expected) = match case.is_slow {
            true => (case.earlier(), &known.old),
            false => (case.line(), &known.new),
        };
        self.plant(case, expected);
        let ended = self.run(None, &line);
        let left = self.tree();
        let is_whole = ended.code == Some(0) && left == *expected;
        assert!(is_whole, "{}, after {what}: {ended:?}, {}", case.name, differing(&left, expected));
    }
}

pub fn finish(mut child: Child, line: &str) -> Ended {
    let started = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("a state") {
            break status;
        }
        if started.elapsed() > PATIENCE {
            child.kill().expect("it can be killed");
            panic!("{line}: it hangs");
        }
        sleep(Duration::from_micros(300));
    };
    let mut stderr = Vec::new();
    child.stderr.take().expect("a pipe").read_to_end(&mut stderr).expect("what was said");
    let stderr = String::from_utf8_lossy(&stderr).into_owned();
    Ended { code: status.code(), signal: status.signal(), stderr }
}

/// Makes maps, photos, features and the outputs of the stages, each twice.
fn inputs() -> Tree {
    let bench = Bench { place: Place::empty(), inputs: &NONE };
    let place = &bench.place;
    let points = |seed| unlift::synthetic::room(seed, POINTS).points;
    fs::create_dir(place.path("in")).unwrap();
    fs::create_dir(place.path("work")).unwrap();
    place.write_points("in/room.csv", &points(1));
    place.write_points("in/other.csv", &points(2));
    for which in [1, 2] {
        for (at, name) in ["a.png", "b/c.jpg", "d.webp"].into_iter().enumerate() {
            place.write_photo(&format!("in/photos{which}/{name}"), at as u32 + 5 * which);
        }
    }
    for which in [1, 2] {
        let (hidden, images) = (format!("../in/hidden{which}"), format!("../in/images{which}"));
        let features = format!("../in/features{which}.h5");
        let mut lines = vec![
            format!("features ../in/photos{which} --out {features}"),
            format!("obfuscate {features} --scheme cp2d --k 8 --seed {which} --out {images}"),
            format!("obfuscate ../in/room.csv --scheme ppl --k 10 --seed {which} --out {hidden}"),
        ];
        for (of, k) in [(&hidden, 10), (&images, 8)] {
            let lists = format!("{of}/lists.parquet");
            let oracle = format!("neighbors oracle {of}/truth.parquet --inlier-ratio 1 --k {k}");
            lines.push(format!("{oracle} --out {lists}"));
            let recover = format!("recover {of}/released.parquet --neighbors {lists}");
            lines.push(format!("{recover} --out {of}/back.parquet"));
        }
        lines.iter().for_each(|line| _ = bench.succeeds(line));
    }
    Tree::of(&bench.path("in"))
}
