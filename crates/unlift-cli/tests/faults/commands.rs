//! The commands of the tests: command line, inputs and kind of output.

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Writes {
    /// Text only.
    Nothing,
    /// One file, or files that belong together.
    Whole,
    /// Independent files.
    Each,
}

/// A command line in two variants that write to the same places.
#[derive(Debug)]
pub struct Case {
    pub name: &'static str,
    /// `{}` stands for the variant: a seed, or a part of the name of an input.
    line: &'static str,
    /// The line of the first variant, if it differs.
    earlier: Option<&'static str>,
    pub writes: Writes,
    /// Inputs of the second variant.
    pub inputs: &'static [&'static str],
    /// True if it takes minutes; only the full version runs all of it.
    pub is_slow: bool,
}

/// Returns a command whose files belong together and that takes seconds.
const fn whole(name: &'static str, line: &'static str, inputs: &'static [&'static str]) -> Case {
    Case { name, line, earlier: None, writes: Writes::Whole, inputs, is_slow: false }
}

impl Case {
    /// Returns the command line under test.
    pub fn line(&self) -> String {
        self.line.replace("{}", "2")
    }

    /// Returns the command line of an earlier run with the same output.
    pub fn earlier(&self) -> String {
        self.earlier.unwrap_or(self.line).replace("{}", "1")
    }
}

/// Every command. Variants differ in the seed, or else in the input.
pub const CASES: [Case; 19] = [
    whole(
        "obfuscate",
        "obfuscate ../in/room.csv --scheme ppl --k 10 --seed {} --out out",
        &["room.csv"],
    ),
    whole(
        "obfuscate, images",
        "obfuscate ../in/features2.h5 --scheme dcl2d --k 8 --seed {} --out out",
        &["features2.h5"],
    ),
    whole(
        "neighbors oracle",
        "neighbors oracle ../in/hidden2/truth.parquet --inlier-ratio 0.5 --k 10 --seed {} \
               --out lists.parquet",
        &["hidden2/truth.parquet", "hidden2/released.parquet"],
    ),
    whole(
        "neighbors find",
        "neighbors find ../in/hidden{}/released.parquet --source geometric --k 10 \
               --out lists.parquet",
        &["hidden2/released.parquet"],
    ),
    whole(
        "neighbors find, images",
        "neighbors find ../in/images{}/released.parquet --source overlap --out lists.parquet",
        &["images2/released.parquet"],
    ),
    whole(
        "recover",
        "recover ../in/hidden{}/released.parquet --neighbors ../in/hidden{}/lists.parquet \
               --out back.parquet",
        &["hidden2/released.parquet", "hidden2/lists.parquet"],
    ),
    whole(
        "recover, images",
        "recover ../in/images{}/released.parquet --neighbors ../in/images{}/lists.parquet \
               --out back.parquet",
        &["images2/released.parquet", "images2/lists.parquet"],
    ),
    Case {
        writes: Writes::Nothing,
        ..whole(
            "evaluate",
            "evaluate ../in/hidden{}/back.parquet --truth ../in/hidden{}/truth.parquet --json",
            &["hidden2/back.parquet", "hidden2/truth.parquet", "hidden2/released.parquet"],
        )
    },
    whole("features", "features ../in/photos{} --out f.h5", &["photos2/b/c.jpg"]),
    whole("features, a copy", "features ../in/features{}.h5 --out f.h5", &["features2.h5"]),
    whole(
        "audit map",
        "audit map ../in/room.csv --k 10 --schemes olc --inlier-ratios 1 --seed {} \
               --write-clouds --out out",
        &["room.csv"],
    ),
    whole(
        "audit released",
        "audit released ../in/hidden{}/released.parquet --truth ../in/hidden{}/truth.parquet \
               --k 10 --inlier-ratios 1 --out out",
        &["hidden2/released.parquet", "hidden2/truth.parquet"],
    ),
    whole(
        "audit images",
        "audit images ../in/photos2 --schemes lines2d --inlier-ratios 0.5 --k 8 \
               --solver joint-start --seed {} --out out",
        &["photos2/b/c.jpg"],
    ),
    whole(
        "audit images --invert",
        "audit images ../in/features2.h5 --photos ../in/photos2 --invert --max-images 1 \
               --schemes lines2d --inlier-ratios 0.5 --k 8 --solver joint-start --seed {} --out out",
        &["features2.h5", "photos2/b/c.jpg"],
    ),
    Case {
        writes: Writes::Each,
        ..whole("invert", "invert ../in/photos{} --out pictures", &["photos2/b/c.jpg"])
    },
    Case {
        writes: Writes::Each,
        ..whole(
            "invert, released",
            "invert ../in/images{}/released.parquet --recovered ../in/images{}/back.parquet \
               --out pictures",
            &["images2/released.parquet", "images2/back.parquet"],
        )
    },
    Case {
        writes: Writes::Nothing,
        ..whole("metrics", "metrics ../in/photos1 ../in/photos2 --json", &["photos2/b/c.jpg"])
    },
    Case {
        writes: Writes::Nothing,
        ..whole("bench recover", "bench recover --points 1000 --k 10 --inlier-ratios 1 --json", &[])
    },
    Case {
        // This command leaves the same kind of output in less than a second.
        earlier: Some("audit map ../in/room.csv --k 10 --schemes olc --inlier-ratios 1 --out out"),
        is_slow: true,
        ..whole("demo", "demo --out out", &[])
    },
];

pub fn quick() -> impl Iterator<Item = &'static Case> {
    CASES.iter().filter(|case| !case.is_slow)
}

pub fn named(name: &str) -> &'static Case {
    CASES.iter().find(|case| case.name == name).expect("a case")
}
