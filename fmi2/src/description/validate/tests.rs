//! One table that keeps all rules, and one breakage of each rule.

use super::*;
use crate::Value;
use crate::description::{Enumeration, EnumerationItem, Unit};

/// A small table that keeps all rules.
fn sound() -> ModelDescription {
    let mut table = ModelDescription::new("Model", "Model");
    table.units = vec![Unit::mechanical("rad", 0, 0, 0, 1).display("deg", 57.3)];
    table.enumerations = vec![Enumeration::new("Choice", [("one", ""), ("two", "")])];
    let u = table.add(Variable::real("u", 0).input().unit("rad").start(0.0));
    let p = table.add(Variable::real("p", 1).parameter().min(0.0).start(1.0));
    let x = table.add(Variable::real("x", 2).output().initial(Initial::Exact).start(0.0));
    let slope = Variable::real("der(x)", 3).derivative_of_state(x);
    table.add(
        slope
            .depends_on([Dependency::on(u), Dependency::on(x)])
            .initially_depends_on([Dependency::on(u), Dependency::on(p)]),
    );
    table.add(Variable::enumeration("choice", 0, "Choice").parameter().start_value(Value::Integer(2)));
    table
}

#[test]
fn a_sound_table_passes() {
    sound().validate().unwrap();
}

/// A change that breaks one rule, and a part of the message that must come of it.
type Breakage = (fn(&mut ModelDescription), &'static str);

#[test]
fn every_broken_rule_is_named() {
    let breakages: &[Breakage] = &[
        (|t| t.model_name.clear(), "model name is empty"),
        (|t| t.model_identifier = "a b".into(), "C identifier"),
        (|t| t.author = Some("\u{1}".into()), "XML cannot hold"),
        (|t| t.variables.clear(), "no variables"),
        (|t| t.units.push(t.units[0].clone()), "unit `rad` is listed twice"),
        (|t| t.units[0].display_units[0].factor = 0.0, "convert nothing"),
        (|t| t.enumerations[0].name = "x".into(), "name of a variable"),
        (|t| t.enumerations[0].items.clear(), "no items"),
        (|t| t.enumerations[0].items[1].value = 1, "same value"),
        (
            |t| {
                t.enumerations[0].items.push(EnumerationItem { name: "one".into(), value: 7, description: None });
            },
            "item of `Choice` `one` is listed twice",
        ),
        (|t| t.variables[1].name = "u".into(), "variable `u` is listed twice"),
        (|t| t.variables[1].value_reference = 0, "share the value reference 0"),
        (|t| t.variables[0].name = "u v".into(), "structured"),
        (|t| t.variables[0].variability = Variability::Fixed, "does not go with"),
        (|t| t.variables[4].variability = Variability::Continuous, "only a real"),
        (|t| t.variables[0].initial = Some(Initial::Exact), "initial"),
        (|t| t.variables[1].initial = Some(Initial::Approx), "initial"),
        (|t| t.variables[2].initial = None, "must not have a start value"),
        (|t| t.variables[2] = Variable::real("x", 2).output().initial(Initial::Exact), "needs a start value"),
        (|t| t.variables[0].kind = Kind::Real(RealKind::default()), "needs a start"),
        (|t| t.variables[1] = Variable::real("p", 1).parameter().min(2.0).start(1.0), "min <= start <= max"),
        (|t| t.variables[1] = Variable::real("p", 1).parameter().start(f64::NAN), "finite"),
        (|t| t.variables[1] = Variable::real("p", 1).parameter().start(1.0).nominal(0.0), "nominal"),
        (|t| t.variables[1] = Variable::real("p", 1).parameter().start(1.0).unit("m"), "unit `m` is not defined"),
        (
            |t| {
                t.variables[0] = Variable::real("u", 0).input().unit("rad").display_unit("gon").start(0.0);
            },
            "display unit `gon`",
        ),
        (|t| t.variables[3] = Variable::real("der(x)", 3).derivative_of_state(1), "two continuous reals"),
        (|t| t.variables[3] = Variable::real("der(x)", 3).derivative_of_state(99), "two continuous reals"),
        (
            |t| {
                t.add(Variable::real("again", 9).derivative_of_state(2));
            },
            "two derivatives",
        ),
        (
            |t| {
                t.variables[4] = Variable::enumeration("choice", 0, "Other").parameter().start_value(Value::Integer(1));
            },
            "`Other` is not defined",
        ),
        (
            |t| {
                t.variables[4] =
                    Variable::enumeration("choice", 0, "Choice").parameter().start_value(Value::Integer(3));
            },
            "has the value 3",
        ),
        (|t| t.variables[3].dependencies = Some(vec![Dependency::on(1)]), "no known at communication points"),
        (|t| t.variables[3].dependencies = Some(vec![Dependency::on(99)]), "does not exist"),
        (|t| t.variables[3].dependencies = Some(vec![Dependency::on(0), Dependency::on(0)]), "twice"),
        (|t| t.variables[1].dependencies = Some(vec![]), "neither an output nor a state derivative"),
        (|t| t.variables[2].initial_dependencies = Some(vec![]), "not an unknown of initialisation mode"),
        (
            |t| {
                let linear = Dependency::of_kind(0, DependencyKind::Fixed);
                t.variables[3].initial_dependencies = Some(vec![linear]);
            },
            "dependent or constant",
        ),
        (
            |t| {
                t.add(Variable::real("t1", 20).independent());
                t.add(Variable::real("t2", 21).independent());
            },
            "2 independent variables",
        ),
        (
            |t| {
                t.log_categories =
                    vec![crate::description::LogCategory { name: "logAll".into(), description: String::new() }];
            },
            "log category `logAll` is listed twice",
        ),
        (
            |t| {
                t.default_experiment = Some(crate::description::DefaultExperiment {
                    start_time: Some(1.0),
                    stop_time: Some(0.0),
                    step_size: Some(0.0),
                    tolerance: None,
                });
            },
            "stop time 0 before start time 1",
        ),
    ];
    for (breakage, expected) in breakages {
        let mut table = sound();
        breakage(&mut table);
        let found = table.validate().expect_err(expected).to_string();
        assert!(found.contains(expected), "expected `{expected}` in: {found}");
    }
}
