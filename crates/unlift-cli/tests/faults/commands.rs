//! The commands: what each is called with, what it reads and what it leaves.

/// What a command leaves behind when it is done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Writes {
    /// Words alone.
    Nothing,
    /// A file, or files that belong together.
    Whole,
    /// Files each of which is whole by itself.
    Each,
}

/// A command line in two variants, which write to the same places.
#[derive(Debug)]
pub struct Case {
    pub name: &'static str,
    /// `{}` is the variant: a seed, or a part of the name of an input.
    line: &'static str,
    /// Where the first variant is another line.
    earlier: Option<&'static str>,
    pub writes: Writes,
    /// What the second variant reads.
    pub inputs: &'static [&'static str],
    /// Minutes: done in full by the full version alone.
    pub is_slow: bool,
}

const USUAL: Case =
    Case { name: "", line: "", earlier: None, writes: Writes::Whole, inputs: &[], is_slow: false };

impl Case {
    /// The run that the tests are about.
    pub fn line(&self) -> String {
        self.line.replace("{}", "2")
    }

    /// A run that left its output at the same place before.
    pub fn earlier(&self) -> String {
        self.earlier.unwrap_or(self.line).replace("{}", "1")
    }
}

/// Every command. Those with a seed differ by it, the others by what they read.
pub const CASES: [Case; 19] = [
    Case {
        name: "obfuscate",
        line: "obfuscate ../in/room.csv --scheme ppl --k 10 --seed {} --out out",
        inputs: &["room.csv"],
        ..USUAL
    },
    Case {
        name: "obfuscate, images",
        line: "obfuscate ../in/features2.h5 --scheme dcl2d --k 8 --seed {} --out out",
        inputs: &["features2.h5"],
        ..USUAL
    },
    Case {
        name: "neighbors oracle",
        line: "neighbors oracle ../in/hidden2/truth.parquet --inlier-ratio 0.5 --k 10 --seed {} \
               --out lists.parquet",
        inputs: &["hidden2/truth.parquet", "hidden2/released.parquet"],
        ..USUAL
    },
    Case {
        name: "neighbors find",
        line: "neighbors find ../in/hidden{}/released.parquet --source geometric --k 10 \
               --out lists.parquet",
        inputs: &["hidden2/released.parquet"],
        ..USUAL
    },
    Case {
        name: "neighbors find, images",
        line: "neighbors find ../in/images{}/released.parquet --source overlap --out lists.parquet",
        inputs: &["images2/released.parquet"],
        ..USUAL
    },
    Case {
        name: "recover",
        line: "recover ../in/hidden{}/released.parquet --neighbors ../in/hidden{}/lists.parquet \
               --out back.parquet",
        inputs: &["hidden2/released.parquet", "hidden2/lists.parquet"],
        ..USUAL
    },
    Case {
        name: "recover, images",
        line: "recover ../in/images{}/released.parquet --neighbors ../in/images{}/lists.parquet \
               --out back.parquet",
        inputs: &["images2/released.parquet", "images2/lists.parquet"],
        ..USUAL
    },
    Case {
        name: "evaluate",
        line: "evaluate ../in/hidden{}/back.parquet --truth ../in/hidden{}/truth.parquet --json",
        inputs: &["hidden2/back.parquet", "hidden2/truth.parquet", "hidden2/released.parquet"],
        writes: Writes::Nothing,
        ..USUAL
    },
    Case {
        name: "features",
        line: "features ../in/photos{} --out f.h5",
        inputs: &["photos2/b/c.jpg"],
        ..USUAL
    },
    Case {
        name: "features, a copy",
        line: "features ../in/features{}.h5 --out f.h5",
        inputs: &["features2.h5"],
        ..USUAL
    },
    Case {
        name: "audit map",
        line: "audit map ../in/room.csv --k 10 --schemes olc --inlier-ratios 1 --seed {} \
               --write-clouds --out out",
        inputs: &["room.csv"],
        ..USUAL
    },
    Case {
        name: "audit released",
        line: "audit released ../in/hidden{}/released.parquet --truth ../in/hidden{}/truth.parquet \
               --k 10 --inlier-ratios 1 --out out",
        inputs: &["hidden2/released.parquet", "hidden2/truth.parquet"],
        ..USUAL
    },
    Case {
        name: "audit images",
        line: "audit images ../in/photos2 --schemes lines2d --inlier-ratios 0.5 --k 8 \
               --solver joint-start --seed {} --out out",
        inputs: &["photos2/b/c.jpg"],
        ..USUAL
    },
    Case {
        name: "audit images --invert",
        line: "audit images ../in/features2.h5 --photos ../in/photos2 --invert --max-images 1 \
               --schemes lines2d --inlier-ratios 0.5 --k 8 --solver joint-start --seed {} --out out",
        inputs: &["features2.h5", "photos2/b/c.jpg"],
        ..USUAL
    },
    Case {
        name: "invert",
        line: "invert ../in/photos{} --out pictures",
        inputs: &["photos2/b/c.jpg"],
        writes: Writes::Each,
        ..USUAL
    },
    Case {
        name: "invert, released",
        line: "invert ../in/images{}/released.parquet --recovered ../in/images{}/back.parquet \
               --out pictures",
        inputs: &["images2/released.parquet", "images2/back.parquet"],
        writes: Writes::Each,
        ..USUAL
    },
    Case {
        name: "metrics",
        line: "metrics ../in/photos1 ../in/photos2 --json",
        inputs: &["photos2/b/c.jpg"],
        writes: Writes::Nothing,
        ..USUAL
    },
    Case {
        name: "bench recover",
        line: "bench recover --points 1000 --k 10 --inlier-ratios 1 --json",
        writes: Writes::Nothing,
        ..USUAL
    },
    Case {
        name: "demo",
        line: "demo --out out",
        // The same kind of output, in less than a second.
        earlier: Some("audit map ../in/room.csv --k 10 --schemes olc --inlier-ratios 1 --out out"),
        is_slow: true,
        ..USUAL
    },
];

/// Those that end within seconds.
pub fn quick() -> impl Iterator<Item = &'static Case> {
    CASES.iter().filter(|case| !case.is_slow)
}

/// The case of this name.
pub fn named(name: &str) -> &'static Case {
    CASES.iter().find(|case| case.name == name).expect("a case")
}
