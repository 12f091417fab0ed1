//! The whole programme, as `cdpr paper` runs it.

use cdpr_paper::{Verdict, write};

#[test]
fn figures_data_and_claims_are_written() {
    let folder = tempfile::tempdir().unwrap();
    let mut told = Vec::new();
    let claims = write(folder.path(), |what| told.push(what.to_owned())).unwrap();
    assert!(!told.is_empty());
    for name in ["fig8", "fig8_area_as_printed", "fig9", "inverse_dynamics", "massless_spring_and_rigid"] {
        for (ending, head) in [("svg", &b"<svg"[..]), ("png", &b"\x89PNG"[..]), ("csv", b"")] {
            let content = std::fs::read(folder.path().join(format!("{name}.{ending}"))).unwrap();
            assert!(content.len() > 1000 && content.starts_with(head), "{name}.{ending}");
        }
    }
    let left: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.contains("part"))
        .collect();
    assert!(left.is_empty(), "half-written files: {left:?}");
    let text = std::fs::read_to_string(folder.path().join("claims.md")).unwrap();
    assert!(!text.contains("NaN") && !text.contains("inf ") && !text.contains("-inf"), "{text}");
    // The verdicts that the errata stand on.
    let verdict = |part: &str| {
        let found = claims.iter().find(|c| c.statement.contains(part));
        found.unwrap_or_else(|| panic!("no claim about {part}")).verdict.clone()
    };
    assert!(matches!(verdict("rigid cables: x, y and φ oscillate"), Verdict::HoldsOnlyIf(_)));
    assert!(matches!(verdict("more delayed response"), Verdict::HoldsOnlyIf(_)));
    assert!(matches!(verdict("relatively large"), Verdict::HoldsOnlyIf(_)));
    assert!(matches!(verdict("in a straight line"), Verdict::HoldsOnlyIf(_)));
    assert!(matches!(verdict("fast pole"), Verdict::HoldsOnlyIf(_)));
    assert_eq!(verdict("Runge-Kutta"), Verdict::DoesNotHold);
    assert_eq!(verdict("for a prescribed trajectory"), Verdict::Holds);
    assert!(matches!(verdict("high forces at high frequencies"), Verdict::HoldsOnlyIf(_)));
    assert!(matches!(verdict("damping forces"), Verdict::HoldsOnlyIf(_)));
    assert_eq!(verdict("is the equilibrium"), Verdict::Holds);
    // Every file that the table of `docs/paper.md` names, and every statement of `claims.md`, is in it.
    let docs = include_str!("../../docs/paper.md");
    for entry in std::fs::read_dir(folder.path()).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let stem = name.split('.').next().unwrap().trim_start_matches("inverse_dynamics");
        assert!(docs.contains(stem), "{name} is not told of");
    }
    for claim in &claims {
        assert!(docs.contains(&claim.verdict.to_string()), "{}: {}", claim.statement, claim.verdict);
    }
}
