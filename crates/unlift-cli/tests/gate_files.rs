//! `--junit` and `--sarif`: well formed, by the rules of their schemas, and true.

mod common;

use std::fs;

use common::Place;
use serde_json::Value;

const AUDIT: &str =
    "audit map room.csv --scale 1 --k 10 --schemes olc,ppl --inlier-ratios 0.5 --quiet";
const GATES: &str = "--gate all@0.5:0.25<=100 --gate olc:0.25<=1 --gate ppl:0.25:gain<=1";

/// An element of XML: its name, its attributes, what stands in it.
#[derive(Debug, Default)]
struct Element {
    name: String,
    attributes: Vec<(String, String)>,
    children: Vec<Element>,
    text: String,
}

impl Element {
    fn attribute(&self, name: &str) -> &str {
        let found = self.attributes.iter().find(|(known, _)| known == name);
        &found.unwrap_or_else(|| panic!("{}: no {name}", self.name)).1
    }
}

fn unescaped(text: &str) -> String {
    assert!(!text.contains('<'), "{text}");
    let named = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#10;", "\n"), ("&amp;", "&")];
    named.iter().fold(text.to_owned(), |text, (name, c)| text.replace(name, c))
}

/// Reads the elements of `text`, which must be closed in the order in which they were opened.
fn xml(text: &str) -> Element {
    let mut open = vec![Element::default()];
    let body =
        text.strip_prefix("<?xml version=\"1.0\" encoding=\"UTF-8\"?>").expect("a declaration");
    for part in body.split('<').skip(1) {
        let (tag, after) = part.split_once('>').expect("a tag that ends");
        if let Some(name) = tag.strip_prefix('/') {
            let element = open.pop().expect("an open element");
            assert_eq!(element.name, name);
            open.last_mut().expect("a parent").children.push(element);
        } else {
            let (tag, alone) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
            let (name, mut rest) = tag.split_once(' ').unwrap_or((tag, ""));
            let mut element = Element { name: name.to_owned(), ..Element::default() };
            while let Some((key, value)) = rest.split_once("=\"") {
                let (value, more) = value.split_once('"').expect("a value that ends");
                element.attributes.push((key.trim().to_owned(), unescaped(value)));
                rest = more;
            }
            assert!(rest.trim().is_empty(), "{tag}");
            match alone {
                true => open.last_mut().expect("a parent").children.push(element),
                false => open.push(element),
            }
        }
        open.last_mut().expect("an element").text.push_str(unescaped(after).trim());
    }
    assert_eq!(open.len(), 1, "everything is closed");
    open.remove(0).children.remove(0)
}

/// The rules of the schema that Jenkins checks reports by (`junit-10.xsd`): which elements stand in which, which attributes they
/// may have, and which they must have.
fn follows_the_schema(element: &Element) {
    let (inside, may, must): (&[&str], &[&str], &[&str]) = match element.name.as_str() {
        "testsuites" => {
            (&["testsuite"], &["name", "time", "tests", "failures", "disabled", "errors"], &[])
        }
        "testsuite" => (
            &["properties", "testcase", "system-out", "system-err"],
            &[
                "name",
                "tests",
                "failures",
                "errors",
                "skipped",
                "time",
                "timestamp",
                "hostname",
                "id",
                "package",
            ],
            &["name", "tests", "failures", "errors"],
        ),
        "testcase" => (
            &["skipped", "error", "failure", "system-out", "system-err"],
            &["name", "classname", "time", "status", "assertions"],
            &["name"],
        ),
        "failure" | "error" => (&[], &["message", "type"], &[]),
        "system-out" => (&[], &[], &[]),
        other => panic!("no element of JUnit: {other}"),
    };
    for (name, value) in &element.attributes {
        assert!(may.contains(&name.as_str()), "{}: {name}", element.name);
        if name == "time" {
            let (whole, part) = value.split_once('.').expect("a decimal");
            assert!(
                part.len() <= 3 && (whole.to_owned() + part).bytes().all(|c| c.is_ascii_digit())
            );
        }
    }
    must.iter().for_each(|name| assert!(!element.attribute(name).is_empty()));
    for child in &element.children {
        assert!(inside.contains(&child.name.as_str()), "{} in {}", child.name, element.name);
        follows_the_schema(child);
    }
}

#[test]
fn gates_are_test_cases() {
    let place = Place::with_room(500);
    place.ends(&format!("{AUDIT} {GATES} --junit gates.xml --out a"), 1);
    let text = fs::read_to_string(place.path("gates.xml")).unwrap();
    let root = xml(&text);
    follows_the_schema(&root);
    assert_eq!(root.name, "testsuites");
    let suite = &root.children[0];
    for element in [&root, suite] {
        assert_eq!((element.attribute("tests"), element.attribute("failures")), ("3", "2"));
    }
    assert_eq!((suite.attribute("name"), suite.attribute("errors")), ("room.csv", "0"));
    let names: Vec<&str> = suite.children.iter().map(|case| case.attribute("name")).collect();
    assert_eq!(names, ["all@0.5:0.25<=100", "olc:0.25<=1", "ppl:0.25:gain<=1"]);
    let held = &suite.children[0].children[0];
    assert!(held.name == "system-out" && held.text.contains("; "), "{}", held.text);
    assert_eq!(suite.children[1].attribute("classname"), "unlift.olc");
    let failure = &suite.children[1].children[0];
    assert_eq!(failure.name, "failure");
    let said = failure.attribute("message");
    assert!(said.contains(" % came back, at most 1 % may; olc, "), "{said}");
    assert_eq!(failure.text, format!("olc:0.25<=1: {said}"));
}

/// What the schema of SARIF 2.1.0 asks of the parts that are written.
fn log_of(place: &Place, name: &str) -> Value {
    let log: Value = serde_json::from_str(&fs::read_to_string(place.path(name)).unwrap()).unwrap();
    let known = |value: &Value, keys: &[&str]| {
        let object = value.as_object().expect("an object");
        object.keys().for_each(|key| assert!(keys.contains(&key.as_str()), "{key}"));
    };
    known(&log, &["$schema", "version", "runs"]);
    assert_eq!(log["version"], "2.1.0");
    let runs = log["runs"].as_array().expect("runs");
    assert_eq!(runs.len(), 1);
    known(&runs[0], &["tool", "invocations", "results", "automationDetails"]);
    let driver = &runs[0]["tool"]["driver"];
    known(driver, &["name", "version", "informationUri", "rules"]);
    assert_eq!(
        (&driver["name"], &driver["version"]),
        (&"unlift".into(), &env!("CARGO_PKG_VERSION").into())
    );
    assert!(driver["informationUri"].as_str().is_some_and(|uri| uri.starts_with("https://")));
    let rules = driver["rules"].as_array().expect("rules");
    for (at, rule) in rules.iter().enumerate() {
        known(rule, &["id", "shortDescription", "help", "defaultConfiguration", "properties"]);
        assert!(rule["id"].is_string() && !rules[..at].contains(rule), "rules are unique");
        assert!(rule["shortDescription"]["text"].is_string() && rule["help"]["text"].is_string());
        assert_eq!(rule["defaultConfiguration"]["level"], "error");
    }
    for invocation in runs[0]["invocations"].as_array().expect("invocations") {
        assert!(invocation["executionSuccessful"].is_boolean(), "required");
    }
    for result in runs[0]["results"].as_array().expect("results") {
        known(result, &["ruleId", "ruleIndex", "level", "message", "locations"]);
        let rule = &rules[result["ruleIndex"].as_u64().expect("an index") as usize];
        assert_eq!(rule["id"], result["ruleId"]);
        assert_eq!(result["level"], "error");
        assert!(result["message"]["text"].as_str().is_some_and(|text| !text.is_empty()));
        let place = &result["locations"][0]["physicalLocation"];
        known(place, &["artifactLocation", "region"]);
        let uri = place["artifactLocation"]["uri"].as_str().expect("a reference");
        assert!(uri.bytes().all(|c| c.is_ascii_alphanumeric() || b"-._~/%:".contains(&c)), "{uri}");
        assert_eq!(place["region"]["startLine"], 1, "without a configuration");
    }
    log
}

#[test]
fn gates_are_rules_and_failed_ones_results() {
    let place = Place::with_room(500);
    fs::create_dir(place.path("my maps")).unwrap();
    fs::rename(place.path("room.csv"), place.path("my maps/room.csv")).unwrap();
    // `ends` splits at spaces.
    #[cfg(unix)]
    std::os::unix::fs::symlink("my maps", place.path("maps+")).unwrap();
    let audit = AUDIT.replace("room.csv", "maps+/room.csv");
    place.ends(&format!("{audit} {GATES} --gate olc:0.25<=1 --sarif gates.sarif --out a"), 1);
    let log = log_of(&place, "gates.sarif");
    let run = &log["runs"][0];
    let ids: Vec<&Value> =
        run["tool"]["driver"]["rules"].as_array().unwrap().iter().map(|rule| &rule["id"]).collect();
    assert_eq!(ids, ["all@0.5:0.25<=100", "olc:0.25<=1", "ppl:0.25:gain<=1"]);
    let results = run["results"].as_array().unwrap();
    let failed: Vec<&Value> = results.iter().map(|result| &result["ruleId"]).collect();
    assert_eq!(failed, ["olc:0.25<=1", "ppl:0.25:gain<=1"]);
    let said = results[0]["message"]["text"].as_str().unwrap();
    assert!(said.starts_with("olc:0.25<=1: ") && said.ends_with(" within 0.25 m"), "{said}");
    let uri = &results[0]["locations"][0]["physicalLocation"]["artifactLocation"]["uri"];
    assert_eq!(uri, "maps%2B/room.csv");
    assert_eq!(run["automationDetails"]["id"], "unlift/maps%2B/room.csv/");
    assert_eq!(run["invocations"][0]["executionSuccessful"], true);
}

#[test]
fn files_of_gates_of_a_share_safe_audit_name_no_map() {
    let place = Place::with_room(500);
    let line = format!("{AUDIT} {GATES} --junit g.xml --sarif g.sarif --share-safe --out a");
    place.ends(&line, 1);
    log_of(&place, "g.sarif");
    for name in ["g.xml", "g.sarif"] {
        let text = fs::read_to_string(place.path(name)).unwrap();
        assert!(!text.contains("room"), "{name}: {text}");
    }
}

#[test]
fn images_that_cannot_be_used_are_an_error_beside_the_gates() {
    let place = Place::with_photos(&["a.jpg", "b.png"]);
    fs::write(place.path("photos/c.png"), "no picture").unwrap();
    let line = "audit images photos --schemes cp2d --inlier-ratios 1 --k 5 --quiet --out a";
    place.ends(&format!("{line} --gate cp2d:10<=100 --junit g.xml --sarif g.sarif"), 3);
    let root = xml(&fs::read_to_string(place.path("g.xml")).unwrap());
    follows_the_schema(&root);
    let suite = &root.children[0];
    assert_eq!((suite.attribute("failures"), suite.attribute("errors")), ("0", "1"));
    let error = &suite.children[1].children[0];
    let said = "1 of 3 images could not be used, and are in no figure";
    assert_eq!((error.name.as_str(), error.attribute("message")), ("error", said));
    let log = log_of(&place, "g.sarif");
    let invocation = &log["runs"][0]["invocations"][0];
    assert_eq!(invocation["executionSuccessful"], false);
    assert_eq!(invocation["toolExecutionNotifications"][0]["message"]["text"], said);
}

#[test]
fn files_of_gates_replace_their_own_kind_and_nothing_else() {
    let place = Place::with_room(300);
    let line = format!("{AUDIT} --gate all:0.25<=100 --out a");
    let refused = |more: &str| {
        let (stdout, stderr) = place.ends(&format!("{line} {more}"), 2);
        assert!(stdout.is_empty() && !place.path("a").exists(), "nothing is computed");
        stderr.lines().next().unwrap_or_default().to_owned()
    };
    fs::write(place.path("theirs.xml"), "<?xml version=\"1.0\"?><project/>").unwrap();
    assert_eq!(
        refused("--junit theirs.xml"),
        "unlift: --junit: theirs.xml: expected nothing, or gates as JUnit XML of an earlier run (else \
         --force), found another file"
    );
    let input = refused("--junit room.csv --force");
    assert!(
        input.starts_with("unlift: --junit: room.csv: expected a file that is not read"),
        "{input}"
    );
    assert_eq!(
        refused("--junit g --sarif ./g"),
        "unlift: --sarif: ./g: expected a file of its own, found one of --junit"
    );
    let without = AUDIT.to_owned() + " --junit g.xml";
    let (_, stderr) = place.ends(&without, 2);
    assert!(
        stderr.contains("--gate <GATE>"),
        "without a gate it would say that all held: {stderr}"
    );
    for _ in 0..2 {
        // Folders are made, as that of the report is.
        place.ends(&format!("{line} --junit g.xml --sarif new/er/g.sarif"), 0);
        assert!(place.path("new/er/g.sarif").is_file());
    }
    // Where the report goes, too.
    let (_, stderr) = place.ends(&format!("{line} --junit a/report.html --force"), 2);
    let own = "unlift: --junit: a/report.html: expected a file of its own, found one of --out";
    assert_eq!(stderr.lines().next(), Some(own));
}
