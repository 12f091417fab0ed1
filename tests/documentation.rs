//! The pages of `docs` and the readme: what they name exists.

use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn pages() -> Vec<PathBuf> {
    let mut pages: Vec<PathBuf> = fs::read_dir(root().join("docs"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "md"))
        .collect();
    pages.push(root().join("README.md"));
    pages.push(root().join("ARCHITECTURE.md"));
    pages
}

/// Text and target of every link and picture of a page.
fn links(text: &str) -> Vec<(&str, &str)> {
    text.match_indices("](")
        .filter_map(|(at, _)| {
            let name = text[..at].rfind('[').map(|from| &text[from + 1..at])?;
            let target = &text[at + 2..];
            Some((name, &target[..target.find(')')?]))
        })
        .collect()
}

#[test]
fn links_lead_somewhere() {
    let mut checked = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        for (name, target) in links(&text) {
            if target.contains("://") || target.starts_with('#') {
                continue;
            }
            let file = page.parent().unwrap().join(target.split('#').next().unwrap());
            assert!(file.exists(), "{}: [{name}]({target})", page.display());
            checked += 1;
        }
    }
    assert!(checked > 50, "{checked}: the links were not found");
}

/// The crates of this workspace that a manifest names as dependencies of any kind.
fn dependencies_within(manifest: &toml::Table, crates: &[String]) -> Vec<String> {
    let kinds = ["dependencies", "dev-dependencies", "build-dependencies"];
    let named = kinds.iter().filter_map(|kind| manifest.get(*kind)?.as_table()).flat_map(toml::Table::keys);
    named.filter(|name| crates.contains(name)).cloned().collect()
}

#[test]
fn the_table_of_crates_names_every_crate_and_what_it_depends_on() {
    let manifest = |folder: &str| -> toml::Table {
        fs::read_to_string(root().join(folder).join("Cargo.toml")).unwrap().parse().unwrap()
    };
    let members: Vec<String> = manifest(".")["workspace"]["members"].clone().try_into().unwrap();
    let manifests: Vec<_> = members.iter().map(|folder| manifest(folder)).collect();
    let crates: Vec<String> = manifests.iter().map(|m| m["package"]["name"].as_str().unwrap().to_owned()).collect();
    let page = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    for ((folder, name), manifest) in members.iter().zip(&crates).zip(&manifests) {
        let row = page.lines().find(|line| line.starts_with(&format!("| `{folder}` ")));
        let row = row.unwrap_or_else(|| panic!("ARCHITECTURE.md has no row for the folder {folder}"));
        let cells: Vec<&str> = row.split(" | ").collect();
        assert_eq!(cells[1], format!("`{name}`"), "{row}");
        for needed in dependencies_within(manifest, &crates) {
            assert!(cells[3].contains(&format!("`{needed}`")), "ARCHITECTURE.md: {name} depends on {needed} too");
        }
    }
}

/// Whether a source file defines a name: `a::b` by its last part, a module by its file.
fn defines(file: &Path, name: &str) -> bool {
    let source = fs::read_to_string(file).unwrap();
    let last = name.rsplit("::").next().unwrap();
    let whole = |before: &str| {
        source.match_indices(&format!("{before}{last}")).any(|(at, found)| {
            let next = source[at + found.len()..].chars().next();
            !next.is_some_and(|c| c.is_alphanumeric() || c == '_')
        })
    };
    ["fn ", "struct ", "enum ", "trait "].iter().any(|kind| whole(kind))
        || source.contains(&format!("pub {last}: "))
        || file.file_stem().is_some_and(|stem| stem == last)
}

#[test]
fn functions_in_the_table_of_equations_exist() {
    let page = root().join("docs/equations.md");
    let text = fs::read_to_string(&page).unwrap();
    let mut checked = 0;
    for (name, target) in links(&text).into_iter().filter(|(_, target)| target.ends_with(".rs")) {
        let name = name.trim_matches('`');
        assert!(defines(&root().join("docs").join(target), name), "{target} has no `{name}`");
        checked += 1;
    }
    assert!(checked > 30, "{checked}: the table was not read");
    assert!(!defines(&root().join("src/kinematics.rs"), "kinematics::jacob"), "part of a name is none");
}

/// Numbers of equations in a table's first column: `(6), (8)` and `(11)-(14)`.
fn numbers(cell: &str) -> Vec<u32> {
    let mut found: Vec<u32> = Vec::new();
    let mut range = false;
    for part in cell.split('(').skip(1) {
        let Some((number, after)) = part.split_once(')') else { continue };
        let Ok(number) = number.parse() else { continue };
        match found.last() {
            Some(&first) if range => found.extend(first + 1..=number),
            _ => found.push(number),
        }
        range = after.starts_with('-');
    }
    found
}

#[test]
fn every_equation_of_the_paper_is_in_the_table() {
    let text = fs::read_to_string(root().join("docs/equations.md")).unwrap();
    let rows = text.lines().filter(|line| line.starts_with("| ("));
    let found: Vec<u32> = rows.flat_map(|line| numbers(line.split('|').nth(1).unwrap())).collect();
    let missing: Vec<u32> = (1..=42).filter(|n| !found.contains(n)).collect();
    assert!(missing.is_empty(), "{missing:?}");
}

#[test]
fn every_erratum_has_its_test() {
    let table = fs::read_to_string(root().join("docs/errata.md")).unwrap();
    let rows = table.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| where")).count() - 1;
    let tests = fs::read_to_string(root().join("paper/tests/errata.rs")).unwrap();
    assert_eq!(rows, tests.matches("#[test]").count());
}

/// Formulas stand in blocks of `math`, and between dollars in a line. Markdown would eat a backslash before punctuation there.
#[test]
fn formulas_are_closed() {
    let mut displayed = 0;
    for page in pages() {
        let text = fs::read_to_string(&page).unwrap();
        assert!(!text.contains("$$"), "{}: write a block of `math`", page.display());
        let blocks: Vec<&str> = text.split("```").collect();
        assert_eq!(blocks.len() % 2, 1, "{}: a block is left open", page.display());
        for (k, block) in blocks.into_iter().enumerate() {
            let formulas: Vec<&str> = match block.strip_prefix("math\n") {
                Some(formula) if k % 2 == 1 => {
                    displayed += 1;
                    vec![formula]
                }
                _ if k % 2 == 1 => continue,
                _ => block.lines().flat_map(inline_formulas).collect(),
            };
            for formula in formulas {
                let count = |part: &str| formula.matches(part).count();
                for [open, close] in [["{", "}"], ["\\begin", "\\end"], ["\\bigl", "\\bigr"], ["\\Bigl", "\\Bigr"]] {
                    assert_eq!(count(open), count(close), "{}: {formula}", page.display());
                }
            }
        }
    }
    assert!(displayed > 10, "{displayed}");
}

/// Formulas between dollars, outside of code.
fn inline_formulas(line: &str) -> Vec<&str> {
    let prose = line.split('`').step_by(2);
    let formulas: Vec<&str> = prose.flat_map(|part| part.split('$').skip(1).step_by(2)).collect();
    for formula in &formulas {
        let eaten = formula.split('\\').skip(1).any(|after| !after.starts_with(|c: char| c.is_alphabetic()));
        assert!(!eaten, "${formula}$");
    }
    formulas
}
