use cdpr::effect::{EffectSpec, Place};
use serde_json::Value;

use super::fixture::{FORCE, NOISE, SPEED, discovery, friction, term};
use super::*;
use crate::outcome::{BeforeAfter, Discovery, Latents, SurveyError, Verdict};
use crate::report::{check, render, summary};

fn json(discovery: &Discovery) -> Value {
    serde_json::from_str(&discovery_json(discovery).unwrap()).unwrap()
}

#[test]
fn what_geometry_was_corrected_stands_apart_from_the_effects() {
    assert_eq!(json(&discovery())["calibration"], serde_json::json!([]));
    let effect = EffectSpec::new("anchor_offset", Some(2), &[0.08, -0.05]).unwrap();
    let error = SurveyError { effect, standard_error: vec![Some(0.01), None] };
    let document = json(&Discovery { survey: vec![error], ..discovery() });
    let corrected = &document["calibration"][0];
    assert_eq!((&corrected["id"], &corrected["cable"]), (&"anchor_offset".into(), &2.into()));
    let x = serde_json::json!({ "value": 0.08, "standard_error": 0.01, "unit": "m" });
    assert_eq!((&corrected["parameters"]["x"], &corrected["parameters"]["y"]["standard_error"]), (&x, &Value::Null));
    assert_eq!(document["effects"].as_array().unwrap().len(), 1);
}

#[test]
fn the_json_keeps_the_contract() {
    let document = json(&discovery());
    assert_eq!(document["schema"], 1);
    assert_eq!(document["verdict"], "ambiguous");
    let located = &document["located"][0];
    assert_eq!(located["where"], "winch[3]");
    assert_eq!(located["share_of_gap"], 0.93);
    assert_eq!(located["when"], serde_json::json!([[12.0, 31.5]]));
    assert_eq!(located["when_in"], serde_json::json!([1]), "the training trial stands second among all");
    assert_eq!(located["depends_on"], serde_json::json!(["speed", "direction"]));
    let effect = &document["effects"][0];
    assert_eq!(effect["id"], "winch_coulomb_friction");
    assert_eq!(effect["cable"], 3);
    let force = &effect["parameters"]["force"];
    assert_eq!((&force["value"], &force["standard_error"], &force["unit"]), (&180.0.into(), &1.9.into(), &"N".into()));
    assert_eq!(effect["parameters"]["transition_speed"]["standard_error"], Value::Null);
    assert_eq!(effect["delta_bic"], -812.4);
    let twins = effect["indistinguishable_from"].as_array().unwrap();
    assert_eq!(twins.len(), 1, "the one that the data tell apart is no twin");
    assert_eq!(twins[0]["id"], "pulley_capstan_loss");
    assert_eq!(twins[0]["delta_bic"], 1.2);
    assert_eq!(twins[0]["separate_by"], "change the pretension");
    assert_eq!(effect["worse"][0]["id"], "winch_viscous_friction");
    let gap = &document["gap"];
    assert_eq!(gap["horizon_s"], 5.0);
    assert_eq!((&gap["train"]["before"], &gap["train"]["after"]), (&41.0.into(), &1.02.into()));
    assert_eq!((&gap["holdout"]["before"], &gap["holdout"]["after"]), (&40.0.into(), &1.04.into()));
    assert_eq!(gap["channels"]["x"]["before"], 11.0, "held-out data where there are any");
    assert_eq!(gap["channels"]["unstretched_length[3]"]["before"], 9.0);
    assert_eq!(gap["horizons"].as_array().unwrap().len(), 3);
    assert_eq!(document["remainder"]["force"]["after"], 1.5);
    assert_eq!(document["channels"]["phi"]["unit"], "rad");
    assert_eq!(document["channels"]["phi"]["whiteness"]["pass"], true);
}

#[test]
fn when_an_effect_begins_stands_beside_its_size() {
    let mut begun = discovery();
    assert!(json(&begun)["effects"][0].get("onset").is_none());
    let found = &mut begun.effects[0];
    found.effect = found.effect.clone().during(Some(40.02), None).unwrap();
    found.onset.from = Some(crate::outcome::Estimated { value: 40.02, standard_error: Some(0.006) });
    let names: Vec<String> = sizes(found).into_iter().map(|size| size.name).collect();
    assert_eq!(names, ["force", "transition_speed", "from"]);
    let onset = &json(&begun)["effects"][0]["onset"];
    assert_eq!((&onset["from"]["value"], &onset["from"]["standard_error"]), (&40.02.into(), &0.006.into()));
    assert!(onset["until"].is_null());
    let page = report(&begun, &About::default());
    assert!(summary(&page).headline.contains("since 40.0\u{a0}s"), "{}", summary(&page).headline);
}

#[test]
fn what_would_have_shown_stands_in_the_json_and_folded_in_the_report() {
    let document = json(&discovery());
    let limits = document["detection_limits"].as_array().unwrap();
    assert_eq!(limits.len(), 4);
    assert_eq!((&limits[0]["id"], &limits[0]["cable"]), (&"winch_coulomb_friction".into(), &1.into()));
    assert_eq!(
        (&limits[0]["parameter"], &limits[0]["size"], &limits[0]["unit"]),
        (&"force".into(), &11.0.into(), &"N".into())
    );
    assert_eq!((&limits[0]["at"]["transition_speed"], &limits[0]["shows"]), (&0.005.into(), &"from".into()));
    assert_eq!((&limits[2]["size"], &limits[2]["excited"]), (&Value::Null, &false.into()));
    assert_eq!(limits[3]["shows"], "up_to");
    assert_eq!(document["cannot_tell"], serde_json::json!(["platform_linear_drag"]));
    assert_eq!(document["at_rest"], false, "friction shows");
    let nothing = Discovery { verdict: Verdict::NoMissingEffect, effects: vec![], located: vec![], ..discovery() };
    let report = report(&nothing, &About::default());
    let rows: Vec<(&str, Option<f64>)> = report.limits.iter().map(|l| (l.label.as_str(), l.size)).collect();
    let worst = ("Coulomb friction on winch\u{a0}2", Some(14.0));
    assert_eq!(rows[..2], [worst, ("linear drag on the platform", None)]);
    let page = render(&report).unwrap();
    for text in
        ["<section id=\"limits\">", "from 14\u{a0}N", "transition speed 0.005", "not at any size met in practice"]
    {
        assert!(page.contains(text), "{text}");
    }
    let words = summary(&report).detail.join(" ");
    assert!(
        words.contains("would have shown, with 99\u{a0}%, Coulomb friction on any winch from 14\u{a0}N."),
        "{words}"
    );
    assert!(words.contains("They do not tell of linear drag on the platform."), "{words}");
}

#[test]
fn a_machine_at_rest_is_not_cleared() {
    let mut nothing = Discovery { verdict: Verdict::NoMissingEffect, effects: vec![], located: vec![], ..discovery() };
    nothing.detection_limits.retain(|limit| limit.effect.id == "platform_linear_drag");
    assert_eq!(json(&nothing)["at_rest"], true);
    let words = summary(&report(&nothing, &About::default()));
    assert_eq!(words.badge, "These data cannot tell");
    assert_eq!(words.headline, "These data cannot tell whether anything is missing: the machine hardly moves in them.");
}

#[test]
fn evidence_beside_the_criterion_is_written() {
    let document = json(&discovery());
    let effect = &document["effects"][0];
    assert_eq!((&effect["null_test"]["shifts"], &effect["null_test"]["as_strong"]), (&99.into(), &0.into()));
    assert_eq!(document["search"]["null_test"]["as_strong"], 40);
    let stability = &effect["stability"];
    assert_eq!((&stability["constant"], &stability["degrees_of_freedom"]), (&true.into(), &2.into()));
    let block = &stability["blocks"][1];
    assert_eq!((&block["trial"], &block["size"]), (&1.into(), &1.01.into()), "the training trial stands second");
    assert_eq!(block["when"], serde_json::json!([30.0, 60.0]));
    let report = report(&discovery(), &About::default());
    assert_eq!(report.method.null_test.and_then(|test| test.exceeded), Some(0));
    let told = report.effects[0].stability.as_ref().unwrap();
    assert_eq!((told.blocks[2].span.trial, told.constant), (1, true));
    // The weaker one counts, and one that cannot be tested leaves the whole untested.
    let mut two = discovery();
    two.effects.push(friction());
    two.effects[1].null_test.as_mut().unwrap().as_strong = 7;
    let exceeded = |d: &Discovery| super::report(d, &About::default()).method.null_test.and_then(|t| t.exceeded);
    assert_eq!(exceeded(&two), Some(7));
    two.effects[0].null_test = None;
    assert_eq!(exceeded(&two), None);
    two.effects.clear();
    assert_eq!(exceeded(&two), Some(40));
}

#[test]
fn verdicts_and_terms_have_their_words() {
    let mut unnamed = discovery();
    unnamed.verdict = Verdict::Unnamed;
    unnamed.effects.clear();
    unnamed.terms = vec![term("platform.force_x", "-34.8*x*abs(y)")];
    let document = json(&unnamed);
    assert_eq!(document["verdict"], "unnamed");
    assert_eq!(document["terms"][0]["target"], "platform.force_x");
    assert_eq!(document["terms"][0]["expression"], "-34.8*x*abs(y)");
    assert_eq!(document["terms"][0]["standard_error"], serde_json::json!([0.6]));
    for (verdict, word) in [
        (Verdict::NoMissingEffect, "no_missing_effect"),
        (Verdict::Named, "named"),
        (Verdict::PartlyNamed, "partly_named"),
    ] {
        let document = json(&Discovery { verdict, ..discovery() });
        assert_eq!(document["verdict"], word);
    }
}

#[test]
fn what_is_left_stands_beside_the_verdict_in_mm_mrad_and_newtons() {
    let document = json(&discovery());
    let five = &document["remaining"][1];
    assert_eq!(five["horizon_s"], 5.0);
    assert!((five["position_mm"].as_f64().unwrap() - 10.0).abs() < 1e-9, "{five}");
    assert!((five["rotation_mrad"].as_f64().unwrap() - 1.5).abs() < 1e-9, "{five}");
    assert_eq!((&five["length_mm"], five["force_N"].as_f64()), (&Value::Null, Some(1.5)));
    let main = &document["gap"]["horizons"][1];
    assert_eq!((main["attainable"].as_f64(), main["judged"].as_bool()), (Some(1.01), Some(true)));
    assert_eq!(document["effects"][0]["named"], true);
}

/// A candidate among the effects was read as a cause.
#[test]
fn effects_without_a_name_stand_apart() {
    let mut partly = discovery();
    partly.verdict = Verdict::PartlyNamed;
    partly.effects[0].named = false;
    let (document, whole) = (json(&partly), json(&discovery()));
    let ids = |of: &Value, key: &str| -> Vec<Value> {
        of[key].as_array().unwrap().iter().map(|effect| effect["id"].clone()).collect()
    };
    assert_eq!(ids(&document, "candidates"), ids(&whole, "effects")[..1]);
    assert_eq!(ids(&document, "effects"), ids(&whole, "effects")[1..]);
    assert_eq!(document["candidates"][0]["named"], false);
    assert!(ids(&whole, "candidates").is_empty());
}

#[test]
fn numbers_that_do_not_exist_are_null() {
    let mut nothing_held_out = discovery();
    for horizon in &mut nothing_held_out.horizons {
        horizon.holdout = BeforeAfter { before: f64::NAN, after: f64::NAN };
    }
    nothing_held_out.effects[0].standard_error = vec![Some(f64::INFINITY), None];
    let document = json(&nothing_held_out);
    assert_eq!(document["gap"]["holdout"]["before"], Value::Null);
    assert_eq!(document["effects"][0]["parameters"]["force"]["standard_error"], Value::Null);
    let report = report(&nothing_held_out, &About::default());
    assert_eq!(report.gap.holdout, None);
    assert_eq!(report.effects[0].parameters[0].standard_error, None);
}

#[test]
fn the_table_has_every_sample_and_empty_cells_for_gaps() {
    let discovery = discovery();
    let text = gap_csv(&discovery);
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    assert_eq!(reader.headers().unwrap(), &COLUMNS[..]);
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 2 * 7 * 2000);
    let of = |channel: &str, k: usize| {
        rows.iter().filter(|r| &r[0] == "runs/held_out.csv" && &r[2] == channel).nth(k).unwrap().clone()
    };
    assert_eq!(&of("phi", 10)[6], "", "no simulation before the first restart");
    assert_eq!(&of("phi", 150)[4], "", "a gap in the measurements");
    assert_eq!(&of("x", 200)[3], "1");
    assert_eq!(&of("x", 201)[3], "0");
    let compared = &discovery.trials[0];
    let shown: f64 = of("unstretched_length[2]", 321)[5].parse().unwrap();
    assert!((shown - compared.before[321][4]).abs() < 1e-6, "{shown}");
}

#[test]
fn the_report_is_drawn_for_every_verdict() {
    let named = |mut d: Discovery| {
        d.verdict = Verdict::Named;
        d.effects[0].alternatives.clear();
        d
    };
    let nothing = |mut d: Discovery| {
        d.verdict = Verdict::NoMissingEffect;
        d.effects.clear();
        d.located.clear();
        d
    };
    let unnamed = |mut d: Discovery| {
        d.verdict = Verdict::Unnamed;
        d.terms = vec![
            term("platform.torque", "3.0*phi - 2.0*vx*abs(vy)"),
            term("winch[2]", "-12.0*unstretched_length_rate[2]"),
        ];
        d
    };
    for (case, sentence) in [
        (discovery(), "Coulomb friction or capstan loss on winch\u{a0}3 is missing"),
        (named(discovery()), "Coulomb friction on winch\u{a0}3 is missing"),
        (nothing(discovery()), "Nothing is missing"),
        (unnamed(discovery()), "of a kind outside the catalogue"),
    ] {
        let mut case = case;
        if case.verdict == Verdict::NoMissingEffect {
            case.horizons.iter_mut().for_each(|h| h.holdout.after = 1.0);
        }
        let report = report(&case, &About { title: "trial runs".to_owned(), ..About::default() });
        check(&report).unwrap();
        let headline = summary(&report).headline;
        assert!(headline.contains(sentence), "{headline}");
        assert!(render(&report).unwrap().contains("trial runs"));
    }
}

#[test]
fn the_report_points_to_the_right_trial_and_breaks_lines_at_restarts() {
    let report = report(&discovery(), &About::default());
    assert_eq!(report.trials[0].name, "held_out.csv", "no folders where the names differ without");
    assert_eq!(report.located[0].when[0].trial, 1);
    let trial = &report.trials[1];
    let series = &trial.series[0];
    let first = trial.time.iter().position(|t| *t >= 5.0).unwrap();
    assert!(series.after[first].is_nan() && series.after[first + 1].is_finite());
    assert_eq!(series.after.iter().skip(first).filter(|v| v.is_nan()).count(), 19, "one break a restart");
    let map = &trial.residuals;
    assert_eq!((map.edges.len(), map.rows.len()), (51, 7));
    assert!(map.rows[0].before[0].is_nan(), "nothing is simulated before the first restart");
    let after = map.rows[0].after[30];
    assert!((0.5..1.0).contains(&after), "{after}: a sine of height σ has the root mean square 0.7 σ");
    assert!(map.rows[0].before[30] > 1.0);
    assert_eq!(report.channels[0].noise, NOISE);
}

#[test]
fn what_shows_nearly_all_the_time_shows_throughout() {
    let mut always = discovery();
    always.located[0].when = vec![(0, 2.0, 98.0)];
    assert!(report(&always, &About::default()).located[0].when.is_empty());
    assert_eq!(json(&always)["located"][0]["when"], serde_json::json!([[2.0, 98.0]]));
}

#[test]
fn a_part_cut_off_a_trial_keeps_its_name_short() {
    let mut cut = discovery();
    cut.trials[0].trial.name = "the last 30 s of runs/first.csv".to_owned();
    cut.holdout_source = "the last 30 s of runs/first.csv".to_owned();
    let report = report(&cut, &About::default());
    assert_eq!(report.trials[0].name, "the last 30 s of first.csv");
    assert_eq!(report.trials[1].name, "first.csv");
    assert_eq!(report.gap.holdout_source, "the last 30 s of first.csv");
}

#[test]
fn parts_of_a_trial_with_a_hole_are_called_after_it() {
    let mut cut = discovery();
    cut.trials[0].trial.name = "runs/check.csv, 0.0 s to 12.5 s".to_owned();
    cut.holdout_source = "the trial runs/check.csv".to_owned();
    let report = report(&cut, &About::default());
    assert_eq!(report.trials[0].name, "check.csv, 0.0 s to 12.5 s");
    assert_eq!(report.gap.holdout_source, "the trial check.csv");
}

#[test]
fn what_the_model_as_given_has_stands_beside_what_was_found() {
    let mut known = discovery();
    let given = EffectSpec { values: vec![120.0, SPEED], ..friction().effect };
    (known.effects[0].given, known.not_shown) = (Some(given.clone()), vec![given.clone()]);
    let json = json(&known);
    assert_eq!(json["effects"][0]["given"]["force"]["value"], 120.0);
    assert_eq!((&json["not_shown"][0]["id"], &json["not_shown"][0]["cable"]), (&given.id.into(), &3.into()));
    let report = report(&known, &About::default());
    assert_eq!(report.effects[0].given[0].value, 120.0);
    assert_eq!(report.not_shown, ["Coulomb friction on winch 3"]);
    let plain = self::json(&discovery());
    assert!(plain["effects"][0].get("given").is_none() && plain["not_shown"].as_array().is_some_and(Vec::is_empty));
}

#[test]
fn friction_is_drawn_against_the_winch_speed() {
    let discovery = discovery();
    let report = report(&discovery, &About::default());
    let [picture] = &report.signatures[..] else { panic!("{} pictures", report.signatures.len()) };
    assert_eq!(picture.label, "Coulomb friction on winch\u{a0}3");
    assert_eq!((picture.x_unit.as_str(), picture.y_unit.as_str()), ("m/s", "N"));
    for p in picture.points.iter().chain(&picture.law) {
        assert!((p[1] - FORCE * (p[0] / SPEED).tanh()).abs() < 1e-9, "{p:?}");
    }
    assert!(picture.points.len() > 300 && picture.law.len() > 100);
}

/// With two effects, each picture shows what the other leaves.
#[test]
fn what_the_other_effect_explains_is_taken_away() {
    let mut both = discovery();
    let mut bias = friction();
    bias.effect = EffectSpec::new("winch_force_bias", Some(3), &[50.0]).unwrap();
    both.effects.push(bias);
    for compared in &mut both.trials {
        compared.latents.iter_mut().for_each(|l| l.pull[2] += 50.0);
    }
    let report = report(&both, &About::default());
    let [first, second] = &report.signatures[..] else { panic!("{} pictures", report.signatures.len()) };
    assert!(first.points.iter().all(|p| (p[1] - FORCE * (p[0] / SPEED).tanh()).abs() < 1e-9));
    assert!(second.points.iter().all(|p| (p[1] - 50.0).abs() < 1e-9 && p[0] == 2e4));
}

/// The force of a winch seen from the platform: a drag law explains it as far as it points against the motion.
#[test]
fn platform_effects_see_the_whole_missing_wrench() {
    let mut drag = discovery();
    drag.effects[0].effect = EffectSpec::new("platform_linear_drag", None, &[30.0]).unwrap();
    for compared in &mut drag.trials {
        for (latent, motion) in compared.latents.iter_mut().zip(&compared.motion) {
            *latent = Latents { wrench: [-30.0 * motion[3], -30.0 * motion[4], 0.0], pull: [0.0; 4].into() };
        }
    }
    let report = report(&drag, &About::default());
    let picture = &report.signatures[0];
    assert!(picture.points.iter().all(|p| (p[1] - 30.0 * p[0]).abs() < 1e-9));
    assert!((picture.law[10][1] - 30.0 * picture.law[10][0]).abs() < 1e-12);
}

#[test]
fn terms_are_drawn_against_their_variable_or_their_own_value() {
    let mut two = discovery();
    two.effects.clear();
    two.verdict = Verdict::Unnamed;
    two.terms = vec![term("winch[3]", "25.0*unstretched_length_rate[3]"), term("platform.force_y", "2.0*x*vy")];
    let report = report(&two, &About::default());
    let [one, many] = &report.signatures[..] else { panic!("{} pictures", report.signatures.len()) };
    assert_eq!(one.x_name, "reel-out speed\u{a0}3");
    assert!(one.law.iter().all(|p| (p[1] - 25.0 * p[0]).abs() < 1e-12));
    assert_eq!(many.x_name, "the term, 2·x·vy");
    assert!(many.law.iter().all(|p| p[0] == p[1]));
}

/// Nothing that acts as a force stands for a sensor's bias: measured against predicted change.
#[test]
fn effects_without_a_force_share_a_picture() {
    let mut sensor = discovery();
    sensor.effects[0].effect = EffectSpec::new("length_sensor_bias", Some(2), &[0.03]).unwrap();
    let report = report(&sensor, &About::default());
    let [picture] = &report.signatures[..] else { panic!("{} pictures", report.signatures.len()) };
    assert!(picture.label.starts_with("all that was found"), "{}", picture.label);
    assert!(picture.points.iter().all(|p| (p[1] - p[0]).abs() < 1.1 * NOISE));
}

#[test]
fn an_anchor_is_at_one_place_throughout_the_json() {
    let mut offset = discovery();
    offset.effects[0].effect = EffectSpec::new("anchor_offset", Some(2), &[0.1, 0.0]).unwrap();
    offset.journal[0].effect = Some(offset.effects[0].effect.clone());
    offset.located[0].place = Place::Anchor(Some(2));
    let document = json(&offset);
    for place in [&document["located"][0], &document["effects"][0], &document["journal"][0]] {
        assert_eq!(place["where"], "cable[2]");
    }
    let report = report(&offset, &About::default());
    assert_eq!((report.located[0].place.as_str(), report.effects[0].place.as_str()), ("anchor[2]", "anchor[2]"));
}

#[test]
fn the_law_is_that_of_the_shape_found() {
    let report = report(&discovery(), &About::default());
    assert_eq!(report.effects[0].equation, "F = 180 tanh(l̇/0.01)");
}

/// What the plots of friction, of a term and the list of channels call a signal.
#[test]
fn a_signal_has_the_same_name_in_all_pictures() {
    let friction_name = report(&discovery(), &About::default()).signatures[0].x_name.clone();
    let mut term_too = discovery();
    term_too.effects.clear();
    term_too.verdict = Verdict::Unnamed;
    let names = |term_on: &str| {
        let mut one = term_too.clone();
        one.terms = vec![term("winch[3]", &format!("25.0*{term_on}"))];
        report(&one, &About::default()).signatures[0].x_name.clone()
    };
    assert_eq!(names("unstretched_length_rate[3]"), friction_name);
    assert_eq!(names("unstretched_length[3]"), crate::report::channel_words("unstretched_length[3]"));
    assert_eq!(names("phi"), crate::report::channel_words("phi"));
}
