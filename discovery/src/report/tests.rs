//! The report as a whole: sentences for each verdict.

mod page;

use super::words::summary;
use super::*;

/// A small report on Coulomb friction at winch 3, two channels, one fitted and one held-out trial.
fn report() -> Report {
    let both = |before, after| BeforeAfter { before, after };
    let channel = |name: &str, unit: &str| Channel {
        name: name.to_owned(),
        unit: unit.to_owned(),
        noise: 0.005,
        samples: 100,
        whiteness: Some(Whiteness { name: "Q(20)".to_owned(), statistic: 18.0, limit: 31.4, pass: true }),
    };
    let trial = |name: &str, holdout| Trial {
        name: name.to_owned(),
        holdout,
        time: vec![0.0, 1.0, 2.0, 3.0],
        series: vec![Series {
            channel: "x".to_owned(),
            measured: vec![0.0, 0.1, f64::NAN, 0.3],
            before: vec![0.0, 0.2, 0.4, 0.9],
            after: vec![0.0, 0.1, 0.2, 0.3],
            expected: 0.01,
        }],
        residuals: ResidualMap {
            edges: vec![0.0, 2.0, 4.0],
            rows: vec![ResidualRow { channel: "x".to_owned(), before: vec![12.0, 40.0], after: vec![1.0, f64::NAN] }],
        },
    };
    Report {
        title: "test bench".to_owned(),
        verdict: Verdict::Named,
        effects: vec![effect("winch_coulomb_friction", "Coulomb friction", "winch[3]")],
        not_shown: vec![],
        ended_early: false,
        changed: None,
        located: vec![Located {
            place: "winch[3]".to_owned(),
            share_of_gap: 0.83,
            when: vec![Span { trial: 0, start: 12.0, end: 31.5 }],
            depends_on: vec!["speed".to_owned(), "direction".to_owned()],
        }],
        terms: vec![],
        gap: Gap {
            horizon_s: 5.0,
            train: both(41.0, 1.02),
            holdout: Some(both(39.5, 1.04)),
            holdout_source: "trial c.csv".to_owned(),
            channels: vec![ChannelGap {
                channel: "x".to_owned(),
                train: both(12.0, 1.0),
                holdout: Some(both(11.0, 1.01)),
            }],
            horizons: vec![HorizonGap { horizon_s: 20.0, train: both(90.0, 1.4), holdout: None }],
        },
        channels: vec![channel("x", "m"), channel("cable_length[3]", "m")],
        instruments: vec![Instrument {
            what: "delay of cable_length".to_owned(),
            value: 0.02,
            standard_error: Some(3e-4),
            unit: "s".to_owned(),
        }],
        remainder: Remainder { force: 1.9, torque: 14.0, force_before: Some(84.0), torque_before: Some(610.0) },
        trials: vec![trial("a.csv", false), trial("c.csv", true)],
        signatures: vec![Signature {
            label: "Coulomb friction on winch 3".to_owned(),
            x_name: "reel-out speed".to_owned(),
            x_unit: "m/s".to_owned(),
            y_name: "missing force".to_owned(),
            y_unit: "N".to_owned(),
            points: (0..40).map(|i| [0.1 * f64::from(i) - 2.0, f64::from(i % 7)]).collect(),
            law: vec![[-2.0, -251.0], [2.0, 251.0]],
        }],
        robot: Robot {
            anchors: vec![[-636.0, -636.0], [636.0, -636.0], [636.0, 636.0], [-636.0, 636.0]],
            attachments: vec![[7.0, -7.0], [-7.0, -7.0], [-7.0, 7.0], [7.0, 7.0]],
            pose: [0.1, 0.1, 0.1],
            path: vec![[0.0, 0.0], [1.0, 1.0]],
        },
        files: vec![FileUsed { role: "training data".to_owned(), path: "a.csv".to_owned() }],
        settings: vec![Setting { name: "horizon".to_owned(), value: "5 s".to_owned() }],
        method: Method {
            candidates: 87,
            trials: 1,
            samples: 200,
            seconds: 3.5,
            null_test: Some(NullTest { runs: 99, allowed: 1, exceeded: Some(0), followed: Some(0) }),
            steps: vec![Step {
                label: "Coulomb friction on winch 3".to_owned(),
                outcome: "added",
                delta_bic: Some(-812.4),
                reason: "largest gain".to_owned(),
            }],
        },
        limits: vec![],
        at_rest: false,
        remarks: vec![],
        corrected: false,
    }
}

fn effect(id: &str, label: &str, place: &str) -> Effect {
    Effect {
        id: id.to_owned(),
        label: label.to_owned(),
        place: place.to_owned(),
        cable: None,
        named: true,
        equation: "F = 251 tanh(l̇/0.02)".to_owned(),
        parameters: vec![Parameter {
            name: "force".to_owned(),
            value: 251.2,
            standard_error: Some(1.9),
            unit: "N".to_owned(),
        }],
        given: vec![],
        delta_bic: -812.4,
        holdout_gap_without: Some(39.5),
        alternatives: vec![],
        stability: Some(stability()),
    }
}

fn stability() -> Stability {
    let block =
        |start: f64, size| Block { span: Span { trial: 0, start, end: start + 1.0 }, size, standard_error: 0.01 };
    Stability {
        blocks: vec![block(0.0, 0.98), block(1.0, 1.01), block(2.0, 1.013)],
        chi_square: 6.2,
        degrees: 2,
        p_value: 0.045,
        spread: 0.014,
        constant: true,
    }
}

fn capstan(indistinguishable: bool) -> Alternative {
    Alternative {
        id: "pulley_capstan_loss".to_owned(),
        label: "capstan loss".to_owned(),
        place: "winch[3]".to_owned(),
        cable: Some(3),
        parameters: vec![],
        delta_bic: 1.2,
        correlation: Some(0.999),
        indistinguishable,
        separate_by: "repeat at another pretension".to_owned(),
    }
}

fn term() -> Term {
    Term {
        target: "platform.force_x".to_owned(),
        expression: "-34.8*x*abs(y)".to_owned(),
        standard_errors: vec![0.6],
        delta_bic: -90.0,
        holdout_gap_without: Some(20.0),
        stability: None,
    }
}

/// The top of the report with plain spaces.
fn top(report: &Report) -> (String, String) {
    let s = summary(report);
    let plain = |text: &str| text.replace('\u{a0}', " ");
    (plain(&s.headline), plain(&[s.lead, s.detail, s.next].concat().join(" ")))
}

#[test]
fn named_says_what_where_how_large_how_sure_and_the_gap() {
    let (headline, text) = top(&report());
    assert_eq!(headline, "Coulomb friction on winch 3 is missing from the model.");
    for part in [
        "Its size: force 251.2 ± 1.9 N.",
        "83 % of the gap sits on winch 3, from 12 to 31.5 s, and depends on speed and direction.",
        "The evidence is very strong (ΔBIC −812).",
        "In 99 control runs on data shifted in time and frequency, chance never explained as much.",
        "(trial c.csv), the error of the model's prediction over 5 s falls from 39.5 to 1.04 times",
        "Unexplained are 1.9 N and 14 N m (root mean square on the platform), and what remains looks like pure noise in every channel.",
    ] {
        assert!(text.contains(part), "`{part}` is not in: {text}");
    }
}

/// An effect that the model has with another size, by itself and beside one that it lacks; and one of which nothing shows.
#[test]
fn what_the_model_has_with_other_numbers_is_not_called_missing() {
    let mut report = report();
    report.effects[0].given =
        vec![Parameter { value: 120.0, standard_error: None, ..report.effects[0].parameters[0].clone() }];
    let (headline, text) = top(&report);
    assert_eq!(headline, "Coulomb friction on winch 3 is not as the model has it.");
    assert!(text.contains("Its size: force 251.2 ± 1.9 N; the model as given has force 120.0 N."), "{text}");
    let partly = Report { verdict: Verdict::PartlyNamed, ..report.clone() };
    let all =
        "Coulomb friction on winch 3 is not as the model has it, but that is not all: more than the noise is left.";
    assert_eq!(top(&partly).0, all);
    report.effects.push(effect("platform_quadratic_drag", "quadratic drag", "platform"));
    assert_eq!(
        top(&report).0,
        "Quadratic drag on the platform is missing from the model. Coulomb friction on winch 3 is not as the model has it."
    );
    let partly = Report { verdict: Verdict::PartlyNamed, ..report.clone() };
    assert!(top(&partly).0.starts_with(
        "Coulomb friction on winch 3 is not as the model has it; quadratic drag on the platform is missing"
    ));
    let nothing = Report {
        verdict: Verdict::NoMissingEffect,
        effects: vec![],
        not_shown: vec!["capstan loss in cable 2".to_owned()],
        gap: Gap {
            train: BeforeAfter { before: 9.0, after: 1.0 },
            holdout: Some(BeforeAfter { before: 9.0, after: 1.0 }),
            ..report.gap.clone()
        },
        ..report
    };
    let headline = top(&nothing).0;
    assert!(
        headline.ends_with("Capstan loss in cable 2 does not show in these data, though the model has it."),
        "{headline}"
    );
}

#[test]
fn named_with_several_effects_lists_them() {
    let mut report = report();
    report.effects.push(effect("platform_quadratic_drag", "quadratic drag", "platform"));
    let (headline, text) = top(&report);
    assert_eq!(
        headline,
        "Two effects are missing from the model: Coulomb friction on winch 3 and quadratic drag on the platform."
    );
    assert!(text.contains("Quadratic drag on the platform: force 251.2 ± 1.9 N."), "{text}");
    assert!(text.contains("for the weakest of them"), "{text}");
    for (place, share) in [("platform.torque", 0.12), ("cable[1]", 0.02)] {
        report.located.push(Located { place: place.to_owned(), share_of_gap: share, when: vec![], depends_on: vec![] });
    }
    let text = top(&report).1;
    assert!(text.contains("Further parts: 12 % on the platform's rotation."), "{text}");
}

#[test]
fn a_law_on_several_winches_is_named_once() {
    let mut report = report();
    report.effects.push(effect("winch_coulomb_friction", "Coulomb friction", "winch[1]"));
    assert_eq!(top(&report).0, "Coulomb friction on winches 1 and 3 is missing from the model.");
    report.effects.push(effect("platform_quadratic_drag", "quadratic drag", "platform"));
    let headline = top(&report).0;
    assert_eq!(
        headline,
        "Two effects are missing from the model: Coulomb friction on winches 1 and 3 and quadratic drag on the platform."
    );
}

#[test]
fn what_changed_between_the_recordings_is_the_headline_where_nothing_explains_the_gap() {
    let said = "The data that were fitted show drag, and those that were held out contradict it.".to_owned();
    let nothing = Report { verdict: Verdict::Unnamed, effects: vec![], changed: Some(said.clone()), ..report() };
    assert_eq!(top(&nothing).0, said);
    let found = Report { verdict: Verdict::Named, changed: None, ..report() };
    assert_ne!(top(&found).0, said);
}

#[test]
fn ambiguous_names_all_and_the_experiment() {
    let mut report = report();
    report.verdict = Verdict::Ambiguous;
    report.effects[0].alternatives = vec![capstan(true)];
    let (headline, text) = top(&report);
    assert_eq!(
        headline,
        "Either Coulomb friction or capstan loss on winch 3 is missing from the model; these data cannot tell which."
    );
    assert!(
        text.contains(
            "To tell Coulomb friction on winch 3 from capstan loss on winch 3: repeat at another pretension."
        ),
        "{text}"
    );
    assert!(text.contains("cdpr experiment --from discovery.json"), "{text}");
    let mut elsewhere = capstan(true);
    elsewhere.place = "cable[1]".to_owned();
    report.effects[0].alternatives.push(elsewhere);
    report.effects.push(effect("platform_quadratic_drag", "quadratic drag", "platform"));
    assert_eq!(
        top(&report).0,
        "Quadratic drag on the platform is missing from the model, and so is one of Coulomb friction on winch 3, capstan loss on winch 3 or capstan loss in cable 1; these data cannot tell which."
    );
}

#[test]
fn partly_named_says_that_it_is_not_all_and_leaves_out_what_has_no_name() {
    let mut report = report();
    report.verdict = Verdict::PartlyNamed;
    report.effects.push(effect("winch_lag", "lag", "winch[3]"));
    report.effects[1].named = false;
    assert_eq!(
        top(&report).0,
        "Coulomb friction on winch 3 is missing from the model, but that is not all: more than the noise is left."
    );
    report.effects[0].alternatives = vec![capstan(true)];
    assert!(top(&report).0.starts_with("Either Coulomb friction or capstan loss on winch 3 is missing"));
    let (_, text) = top(&report);
    assert!(
        text.contains("Lag on winch 3 (") && text.contains("explains a part and is in the model, but is no cause."),
        "{text}"
    );
    // No recording is worth planning for what is no cause, nor is its evidence any.
    report.effects[1].alternatives = vec![capstan(true)];
    report.effects[1].delta_bic = -11.0;
    let (_, text) = top(&report);
    assert!(!text.contains("To tell lag on winch 3") && !text.contains("ΔBIC −11"), "{text}");
    // What explains next to nothing is no headline.
    report.verdict = Verdict::Unnamed;
    report.effects[0].named = false;
    assert_eq!(top(&report).0, "Something is missing from the model that nothing tried explains.");
}

#[test]
fn unnamed_says_so_and_gives_the_term() {
    let mut report = report();
    report.verdict = Verdict::Unnamed;
    report.terms = vec![term()];
    assert_eq!(
        top(&report).0,
        "Coulomb friction on winch 3 is missing from the model, and so is a force on the platform along x of a kind outside the catalogue."
    );
    report.effects.clear();
    let (headline, text) = top(&report);
    assert_eq!(headline, "A force on the platform along x is missing from the model, of a kind outside the catalogue.");
    assert!(
        text.contains("The best description found is −(34.80 ± 0.60)·x·abs(y) (platform, force along x)"),
        "{text}"
    );
    report.terms.clear();
    report.located.clear();
    assert_eq!(top(&report).0, "Something is missing from the model that nothing tried explains.");
}

#[test]
fn more_than_one_are_missing() {
    let mut report = report();
    report.verdict = Verdict::Unnamed;
    report.terms = vec![term(), Term { target: "winch[2]".to_owned(), ..term() }];
    assert!(top(&report).0.ends_with(
        "is missing from the model, and so are a force on the platform along x and a force on winch 2 of a kind outside the catalogue."
    ));
    report.effects.clear();
    assert_eq!(
        top(&report).0,
        "A force on the platform along x and a force on winch 2 are missing from the model, of a kind outside the catalogue."
    );
    report.terms.clear();
    report.verdict = Verdict::Ambiguous;
    let places = [["winch[1]", "winch[3]"], ["winch[1]", "anchor[3]"]];
    let headlines = places.map(|places| {
        report.effects = places.map(|place| effect("winch_coulomb_friction", "Coulomb friction", place)).to_vec();
        for effect in &mut report.effects {
            effect.alternatives = vec![Alternative { place: effect.place.clone(), ..capstan(true) }];
        }
        top(&report).0
    });
    let either = "Either Coulomb friction or capstan loss";
    let tell = "missing from the model; these data cannot tell which.";
    assert_eq!(headlines[0], format!("{either} on winches 1 and 3 is {tell}"));
    assert!(headlines[1].contains(&format!(" are {tell}")), "{}", headlines[1]);
}

/// Held-out data decide what stays, so nothing may be said to be new to the search.
#[test]
fn held_out_data_that_decided_are_not_called_unseen() {
    let mut report = report();
    for held_out in [true, false] {
        let page = render(&report).expect("a page");
        let text = page.split("<script").next().unwrap_or_default();
        for claim in ["not seen", "never saw", "did not see", "held out from the search", "Held out from the search"] {
            assert!(!text.contains(claim), "`{claim}`, held out: {held_out}");
        }
        report.gap.holdout = None;
        report.gap.channels[0].holdout = None;
    }
}

#[test]
fn a_signal_has_one_name_on_the_page() {
    let page = render(&report()).expect("a page");
    let text = page.split("<script").next().unwrap_or_default();
    assert!(text.contains("<li>position x</li>"), "rows of the picture of errors");
    assert!(!text.contains("<li>x</li>"));
}

#[test]
fn expressions_are_printed_for_people() {
    let printed = |text| super::printed(text, &[]);
    assert_eq!(printed("-3.49981866852225e1*x*abs(y)"), "−35·x·abs(y)");
    assert_eq!(
        printed("2.0*vx^2 - 1.23456e-7*winch_force[3]*sin(0.5*time)"),
        "2·vx^2 − 1.235×10⁻⁷·winch_force[3]·sin(0.5·time)"
    );
    assert_eq!(printed("x2 + 1e"), "x2 + 1e");
    let wave = "899.876*sin(2.499961*x^3)";
    assert_eq!(super::printed(wave, &[12.0, 0.0012]), "900·sin(2.5·x^3)");
    assert_eq!(super::term(wave, &[12.0, 0.0012]), "(900 ± 12)·sin((2.5000 ± 0.0012)·x^3)");
    assert_eq!(super::term(wave, &[f64::NAN, f64::NAN]), "899.9·sin(2.5·x^3)");
}

#[test]
fn nothing_missing_is_said_plainly_and_only_near_the_noise() {
    let mut report = report();
    report.verdict = Verdict::NoMissingEffect;
    report.effects.clear();
    report.located.clear();
    let (headline, text) = top(&report);
    assert_eq!(headline, "Nothing is missing: the model agrees with the measurements to within their noise.");
    assert!(text.contains("is off by 1.04 times"), "{text}");
    report.corrected = true;
    assert!(top(&report).0.starts_with("No law is missing: with its geometry corrected"), "{}", top(&report).0);
    report.corrected = false;
    report.gap.holdout = Some(BeforeAfter { before: 1.6, after: 1.6 });
    report.remainder.force = 3.13;
    assert_eq!(top(&report).0, "No effect is missing, but a disturbance of about 3.1 N was not recorded.");
    report.channels.iter_mut().filter_map(|c| c.whiteness.as_mut()).for_each(|w| w.pass = false);
    assert_eq!(top(&report).0, "No missing effect was found that the data support.");
}

#[test]
fn a_law_on_some_cable_is_said_of_any() {
    let any = super::limit::without_number;
    assert_eq!(any("Coulomb friction on winch\u{a0}3"), "Coulomb friction on any winch");
    assert_eq!(any("bias in the measured unstretched length\u{a0}2"), "bias in any measured unstretched length");
    assert_eq!(any("axial mass at the platform end in cable\u{a0}12"), "axial mass at the platform end in any cable");
    assert_eq!(any("linear drag on the platform"), "linear drag on the platform");
}

#[test]
fn control_runs_say_how_often_chance_did_as_well() {
    let mut report = report();
    let mut said = |exceeded, followed| {
        report.method.null_test = Some(NullTest { runs: 99, allowed: 1, exceeded, followed });
        let method = super::words::control_method(&report).expect("a check");
        (super::control_runs(&report).unwrap_or_default(), method)
    };
    assert!(said(Some(1), Some(0)).0.ends_with("chance explained as much once."));
    assert!(said(Some(4), Some(0)).0.ends_with("chance explained as much 4 times."));
    let (none, method) = said(None, Some(2));
    assert_eq!(none, "");
    assert!(
        method.contains("too short to tell") && method.contains("chance reached what the search would follow 2 times"),
        "{method}"
    );
    report.verdict = Verdict::NoMissingEffect;
    report.effects.clear();
    report.located.clear();
    report.method.null_test = Some(NullTest { runs: 99, allowed: 1, exceeded: Some(40), followed: Some(0) });
    let text = top(&report).1;
    assert!(
        text.contains("In 40 of 99 control runs on data shifted in time and frequency, chance explains as much"),
        "{text}"
    );
    assert!(render(&report).expect("a page").contains("weighed again 99 times"));
}

#[test]
fn without_held_out_data_the_page_says_so() {
    let mut report = report();
    report.gap.holdout = None;
    report.gap.channels[0].holdout = None;
    assert!(top(&report).1.contains("On the data fitted (none were held out)"));
    assert!(render(&report).expect("a page").contains("Nothing was held out"));
}
