//! The grammar of names under `variableNamingConvention="structured"` (FMI 2.0.3, section 2.2.9).

/// Is `name` a structured name, such as `a.b[1,2].'any text'` or `der(x,2)`?
pub(crate) fn is_structured(name: &str) -> bool {
    if let Some(rest) = name.strip_prefix("der(")
        && let Some(inner) = rest.strip_suffix(')')
    {
        return is_derivative_argument(inner);
    }
    is_identifier(name)
}

/// What stands between `der(` and `)`: an identifier, perhaps with the order of the derivative.
fn is_derivative_argument(inner: &str) -> bool {
    let mut scan = Scan(inner);
    scan.identifier() && (scan.0.is_empty() || (scan.take(',') && scan.digits() && scan.0.is_empty()))
}

fn is_identifier(name: &str) -> bool {
    let mut scan = Scan(name);
    scan.identifier() && scan.0.is_empty()
}

/// The text not yet read; each method reads one part of the grammar and says whether it was there.
struct Scan<'a>(&'a str);

impl Scan<'_> {
    fn take(&mut self, wanted: char) -> bool {
        let rest = self.0.strip_prefix(wanted);
        self.0 = rest.unwrap_or(self.0);
        rest.is_some()
    }

    fn take_if(&mut self, wanted: impl Fn(char) -> bool) -> bool {
        let mut chars = self.0.chars();
        let there = chars.next().is_some_and(wanted);
        if there {
            self.0 = chars.as_str();
        }
        there
    }

    fn digits(&mut self) -> bool {
        let before = self.0.len();
        while self.take_if(|c| c.is_ascii_digit()) {}
        self.0.len() < before
    }

    fn identifier(&mut self) -> bool {
        loop {
            if !self.part() {
                return false;
            }
            if !self.take('.') {
                return true;
            }
        }
    }

    fn part(&mut self) -> bool {
        let named = if self.take('\'') { self.quoted() } else { self.bare() };
        named && (!self.take('[') || self.indices())
    }

    fn bare(&mut self) -> bool {
        let first = self.take_if(|c| c == '_' || c.is_ascii_alphabetic());
        while self.take_if(|c| c == '_' || c.is_ascii_alphanumeric()) {}
        first
    }

    fn quoted(&mut self) -> bool {
        let mut length = 0;
        while !self.take('\'') {
            let there = if self.take('\\') {
                self.take_if(|c| "'\"?\\abfnrtv".contains(c))
            } else {
                self.take_if(|c| (c == ' ' || c.is_ascii_graphic()) && !"'\"\\`".contains(c))
            };
            if !there {
                return false;
            }
            length += 1;
        }
        length > 0
    }

    fn indices(&mut self) -> bool {
        while self.digits() {
            if self.take(']') {
                return true;
            }
            if !self.take(',') {
                return false;
            }
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::is_structured;

    #[test]
    fn accepts_the_standard_forms() {
        for name in [
            "x",
            "_x1",
            "winch_force[1]",
            "a.b[1,23].c",
            "der(x)",
            "der(a.b[1],2)",
            "effect.winch_lag[3].time_constant",
            "'any text 100%'",
            "a.'it\\'s'.b",
            "der",
        ] {
            assert!(is_structured(name), "{name}");
        }
    }

    #[test]
    fn refuses_the_rest() {
        for name in [
            "",
            "1x",
            "a b",
            "a..b",
            "a.",
            ".a",
            "a[]",
            "a[1",
            "a[1,]",
            "a[-1]",
            "a[x]",
            "a]",
            "der()",
            "der(x",
            "der(x,)",
            "der(x,y)",
            "der(der(x))",
            "''",
            "'a",
            "a-b",
            "a\n",
            "ä",
            "'a\\q'",
        ] {
            assert!(!is_structured(name), "{name}");
        }
    }
}
