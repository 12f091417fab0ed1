//! The page: safe, complete and of one piece.

use super::*;

#[test]
fn text_from_outside_is_escaped_everywhere() {
    const EVIL: &str = "</script><img src=x onerror=alert(1)>\"'&<!--";
    let mut report = report();
    report.verdict = Verdict::Unnamed;
    report.title = EVIL.to_owned();
    report.terms = vec![Term { target: EVIL.to_owned(), expression: EVIL.to_owned(), ..term() }];
    report.remarks = vec![EVIL.to_owned()];
    report.gap.holdout_source = EVIL.to_owned();
    report.located[0].place = format!("sensor.{EVIL}");
    report.located[0].depends_on = vec![EVIL.to_owned()];
    for text in [&mut report.files[0].path, &mut report.settings[0].value, &mut report.method.steps[0].reason] {
        *text = EVIL.to_owned();
    }
    let found = &mut report.effects[0];
    for text in [&mut found.id, &mut found.label, &mut found.place, &mut found.equation] {
        *text = EVIL.to_owned();
    }
    found.parameters[0].name = EVIL.to_owned();
    found.parameters[0].unit = EVIL.to_owned();
    found.alternatives = vec![Alternative { separate_by: EVIL.to_owned(), label: EVIL.to_owned(), ..capstan(true) }];
    let plot = &mut report.signatures[0];
    for text in [&mut plot.label, &mut plot.x_name, &mut plot.x_unit, &mut plot.y_name] {
        *text = EVIL.to_owned();
    }
    report.channels[0].name = EVIL.to_owned();
    report.channels[0].unit = EVIL.to_owned();
    report.gap.channels[0].channel = EVIL.to_owned();
    for trial in &mut report.trials {
        trial.name = EVIL.to_owned();
        trial.series[0].channel = EVIL.to_owned();
        trial.residuals.rows[0].channel = EVIL.to_owned();
    }
    let page = render(&report).expect("a page");
    assert!(!page.contains("<img"), "markup came through");
    assert!(!page.contains("<!--"), "a comment came through");
    assert_eq!(page.matches("</script>").count(), 3, "a script element was closed early");
    let data: serde_json::Value = serde_json::from_str(embedded(&page)).expect("valid JSON");
    assert_eq!(data["trials"][0]["name"], EVIL);
}

/// The JSON for the plots.
fn embedded(page: &str) -> &str {
    let start = page.find("id=\"report-data\">").expect("the data element") + "id=\"report-data\">".len();
    &page[start..start + page[start..].find("</script>").expect("its end")]
}

#[test]
fn plot_data_are_json_with_gaps_as_null() {
    let page = render(&report()).expect("a page");
    let data: serde_json::Value = serde_json::from_str(embedded(&page)).expect("valid JSON");
    let series = &data["trials"][0]["series"][0];
    assert_eq!(series["measured"], serde_json::json!([0.0, 0.1, null, 0.3]));
    assert_eq!(data["trials"][0]["spans"], serde_json::json!([[12.0, 31.5]]));
    assert_eq!(data["trials"][0]["rows"][0]["after"], serde_json::json!([1.0, null]));
}

#[test]
fn the_page_loads_nothing_from_elsewhere() {
    let page = render(&report()).expect("a page");
    for needle in ["src=", "<link", "@import", "url(", "href=", "<iframe"] {
        // The plotting library's own text may contain such words; the page's markup may not.
        let markup: String = page.split("<script>").next().unwrap_or_default().to_owned();
        assert!(!markup.contains(needle), "`{needle}` in the page's markup");
    }
    assert!(page.contains("default-src 'none'"));
    assert!(page.contains("Copyright (c) 2022 Leon Sorokin"), "the library's licence travels with it");
}

#[test]
fn every_section_is_there() {
    let mut report = report();
    report.effects[0].alternatives = vec![capstan(false)];
    let page = render(&report).expect("a page");
    for id in ["time", "residuals", "law", "alternatives", "verification", "numbers"] {
        assert!(page.contains(&format!("<section id=\"{id}\">")), "{id}");
    }
    assert!(page.contains("winch marked"), "the winch is marked in the drawing");
    assert!(page.contains("class=\"law\""), "the law is drawn");
    assert!(page.contains("times larger"), "scale is stated");
    assert!(page.contains("Is it the same throughout?"));
    assert_eq!(page.matches("class=\"mean\"").count(), 3, "a point for each block");
}

#[test]
fn data_that_do_not_fit_together_are_refused_by_name() {
    let message = |change: &dyn Fn(&mut Report)| {
        let mut report = report();
        change(&mut report);
        render(&report).expect_err("refused").to_string()
    };
    assert_eq!(
        message(&|r| r.trials[0].series[0].after.truncate(1)),
        "`after` of channel `x` in trial `a.csv`: found 1 values, expected 4"
    );
    assert_eq!(
        message(&|r| r.trials[1].series[0].channel = "z".to_owned()),
        "trial `c.csv` names the channel `z`, which is not among the report's channels"
    );
    assert_eq!(message(&|r| r.trials[0].time[2] = 1.0), "time of trial `a.csv`: time does not increase after 1 s");
    assert_eq!(message(&|r| r.effects.clear()), "the verdict is `named`, but no effect is listed");
    assert_eq!(
        message(&|r| r.located[0].when[0].trial = 7),
        "`when` of winch[3] points to trial 7, but there are only 2"
    );
}

#[test]
fn the_static_picture_is_a_whole_svg_file() {
    let report = report();
    let (trial, channel) = most_telling(&report).expect("a trial");
    assert_eq!((trial.name.as_str(), channel), ("c.csv", "x"));
    let svg = gap_picture(&report, trial, channel).expect("a picture");
    assert!(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\""));
    assert!(svg.trim_end().ends_with("</svg>"));
    assert!(!svg.contains("NaN"), "gaps break the line");
    assert!(svg.contains(">39.5<") && svg.contains(">1.04<"), "both bars have their numbers");
    assert!(gap_picture(&report, trial, "nope").is_err());
}

#[test]
fn a_report_with_the_least_content_still_renders() {
    let mut report = report();
    report.verdict = Verdict::NoMissingEffect;
    report.effects.clear();
    report.located.clear();
    report.trials.clear();
    report.signatures.clear();
    report.files.clear();
    report.settings.clear();
    report.method.steps.clear();
    report.gap.channels.clear();
    report.gap.horizons.clear();
    report.robot.path.clear();
    let page = render(&report).expect("a page");
    assert!(page.contains("Nothing is missing"));
}

/// Those of six cables lay one upon another where a winch stands in the middle of a side.
#[test]
fn names_of_winches_stand_apart() {
    let mut report = report();
    report.located.clear();
    report.effects.clear();
    report.robot.anchors = vec![[-2.0, -1.5], [0.1, -1.6], [2.0, -1.5], [2.0, 1.5], [-0.2, 1.6], [-2.0, 1.5]];
    report.robot.attachments = report.robot.anchors.iter().map(|[x, y]| [0.1 * x, 0.1 * y]).collect();
    let svg = robot::draw(&report).svg;
    let number = |text: &str, name: &str| -> f64 {
        let value = text.split(&format!("{name}=\"")).nth(1).and_then(|rest| rest.split('"').next());
        value.and_then(|value| value.parse().ok()).expect("a coordinate")
    };
    let names: Vec<[f64; 2]> = svg
        .split("<text")
        .filter(|text| text.contains(">winch "))
        .map(|text| ["x", "y"].map(|n| number(text, n)))
        .collect();
    assert_eq!(names.len(), 6);
    for (i, a) in names.iter().enumerate() {
        // A name is some 60 wide and 16 high.
        assert!(names[..i].iter().all(|b| (a[0] - b[0]).abs() > 80.0 || (a[1] - b[1]).abs() > 16.0), "{names:?}");
    }
}
