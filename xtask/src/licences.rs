//! Licences and sources of all dependencies against `deny.toml`, from `cargo metadata`, without a network.

use std::collections::BTreeMap;
use std::fs;

use anyhow::{Context, Result, bail};
use serde::Deserialize;
use serde_json::Value;
use spdx::{Expression, Licensee};

use crate::project::Project;

/// The part of `deny.toml` that is checked here.
#[derive(Deserialize)]
struct Rules {
    licenses: Licenses,
    sources: Sources,
}

#[derive(Deserialize)]
struct Licenses {
    allow: Vec<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "kebab-case")]
struct Sources {
    allow_registry: Vec<String>,
}

/// Checks every package that the lock file can bring in, on any target; prints how many stand under which licence.
pub(crate) fn check(project: &Project) -> Result<()> {
    let file = project.root.join("deny.toml");
    let text = fs::read_to_string(&file).with_context(|| format!("cannot read {}", file.display()))?;
    let rules: Rules = toml::from_str(&text).with_context(|| file.display().to_string())?;
    let packages = project.metadata["packages"].as_array().context("cargo metadata lists no packages")?;
    let mut counts = BTreeMap::<&str, usize>::new();
    let mut faults = Vec::new();
    for package in packages {
        match judge(package, &rules) {
            Ok(licence) => *counts.entry(licence).or_default() += 1,
            Err(error) => faults.push(format!(
                "{} {}: {error:#}",
                package["name"].as_str().unwrap_or("?"),
                package["version"].as_str().unwrap_or("?")
            )),
        }
    }
    if !faults.is_empty() {
        bail!("not allowed by {}:\n  {}", file.display(), faults.join("\n  "));
    }
    for (licence, count) in counts {
        println!("{count:5}  {licence}");
    }
    Ok(())
}

/// The licence expression of one package, if it and the place it comes from are allowed.
fn judge<'a>(package: &'a Value, rules: &Rules) -> Result<&'a str> {
    if let Some(source) = package["source"].as_str() {
        let registry = source.split_once('+').map_or(source, |(_, url)| url);
        let known = source.starts_with("registry+") && rules.sources.allow_registry.iter().any(|url| url == registry);
        if !known {
            bail!("comes from {source}, which is not among [sources] allow-registry");
        }
    }
    let text = package["license"].as_str().context("names no licence in its Cargo.toml")?;
    let expression = Expression::parse_mode(text, spdx::ParseMode::LAX)
        .map_err(|error| anyhow::anyhow!("its licence `{text}` cannot be read: {}", error.reason))?;
    let allowed = rules
        .licenses
        .allow
        .iter()
        .map(|name| {
            Licensee::parse(name).map_err(|error| anyhow::anyhow!("[licenses] allow: `{name}`: {}", error.reason))
        })
        .collect::<Result<Vec<_>>>()?;
    if !expression.evaluate(|wanted| allowed.iter().any(|licensee| licensee.satisfies(wanted))) {
        bail!("its licence `{text}` is not among [licenses] allow");
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn rules() -> Rules {
        toml::from_str(
            "licenses.allow = ['MIT', 'Apache-2.0']\n\
             sources.allow-registry = ['https://github.com/rust-lang/crates.io-index']",
        )
        .unwrap()
    }

    const REGISTRY: &str = "registry+https://github.com/rust-lang/crates.io-index";

    #[test]
    fn one_allowed_alternative_is_enough() {
        let package = json!({"license": "GPL-3.0-only OR MIT", "source": REGISTRY});
        assert_eq!(judge(&package, &rules()).unwrap(), "GPL-3.0-only OR MIT");
    }

    #[test]
    fn the_old_slash_reads_as_or() {
        let package = json!({"license": "MIT/Apache-2.0", "source": REGISTRY});
        assert!(judge(&package, &rules()).is_ok());
    }

    #[test]
    fn every_part_of_an_and_must_be_allowed() {
        let package = json!({"license": "MIT AND GPL-3.0-only", "source": REGISTRY});
        let error = judge(&package, &rules()).unwrap_err().to_string();
        assert!(error.contains("MIT AND GPL-3.0-only"), "{error}");
    }

    #[test]
    fn a_missing_licence_and_a_foreign_source_are_refused() {
        assert!(judge(&json!({"license": null, "source": REGISTRY}), &rules()).is_err());
        let package = json!({"license": "MIT", "source": "git+https://example.org/x#1"});
        let error = judge(&package, &rules()).unwrap_err().to_string();
        assert!(error.contains("example.org"), "{error}");
    }
}
