//! XML-RPC, as far as ROS uses it.

use std::fmt::Write as _;

use roxmltree::{Document, Node, ParsingOptions};

/// The most nodes of a document.
const MOST_NODES: u32 = 1_000_000;

/// The deepest nesting of values; ROS nests five deep.
const DEEPEST: usize = 20;

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Value {
    Int(i32),
    Bool(bool),
    Text(String),
    List(Vec<Value>),
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Value::Text(text.to_owned())
    }
}

impl Value {
    pub(crate) fn text(&self) -> Option<&str> {
        if let Value::Text(text) = self { Some(text) } else { None }
    }

    /// The elements of a list; none if it is not a list.
    pub(crate) fn items(&self) -> &[Value] {
        if let Value::List(items) = self { items } else { &[] }
    }

    /// The texts of a list.
    pub(crate) fn texts(&self) -> Vec<String> {
        self.items().iter().filter_map(Value::text).map(str::to_owned).collect()
    }

    fn write(&self, out: &mut String) {
        out.push_str("<value>");
        match self {
            Value::Int(number) => {
                let _ = write!(out, "<int>{number}</int>");
            }
            Value::Bool(truth) => {
                let _ = write!(out, "<boolean>{}</boolean>", u8::from(*truth));
            }
            Value::Text(text) => {
                let _ = write!(out, "<string>{}</string>", escaped(text));
            }
            Value::List(items) => {
                out.push_str("<array><data>");
                for item in items {
                    item.write(out);
                }
                out.push_str("</data></array>");
            }
        }
        out.push_str("</value>");
    }
}

/// The text of a call.
pub(crate) fn call(method: &str, parameters: &[Value]) -> String {
    let mut text = format!("<?xml version=\"1.0\"?><methodCall><methodName>{method}</methodName>");
    write_parameters(parameters, &mut text);
    text + "</methodCall>"
}

/// The text of an answer.
pub(crate) fn answer(value: Value) -> String {
    let mut text = "<?xml version=\"1.0\"?><methodResponse>".to_owned();
    write_parameters(&[value], &mut text);
    text + "</methodResponse>"
}

/// The method and the parameters of a call; what is wrong with it, in a phrase.
pub(crate) fn read_call(text: &str) -> Result<(String, Vec<Value>), String> {
    let document = document(text)?;
    let root = document.root_element();
    let method = child(root, "methodName").and_then(|name| name.text()).ok_or("it names no method")?;
    let parameters = child(root, "params").map_or(Ok(Vec::new()), parameters)?;
    Ok((method.trim().to_owned(), parameters))
}

/// The value of an answer; what is wrong with it, or what it says went wrong, in a phrase.
pub(crate) fn read_answer(text: &str) -> Result<Value, String> {
    let document = document(text)?;
    let root = document.root_element();
    if let Some(fault) = child(root, "fault") {
        let said: Vec<&str> = fault.descendants().filter(Node::is_text).filter_map(|node| node.text()).collect();
        return Err(format!("it reports: {}", said.join(" ").split_whitespace().collect::<Vec<_>>().join(" ")));
    }
    let values = child(root, "params").map_or(Ok(Vec::new()), parameters)?;
    values.into_iter().next().ok_or_else(|| "it has no value".to_owned())
}

fn document(text: &str) -> Result<Document<'_>, String> {
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    Document::parse_with_options(text, options).map_err(|error| format!("it is not XML: {error}"))
}

fn write_parameters(parameters: &[Value], out: &mut String) {
    out.push_str("<params>");
    for parameter in parameters {
        out.push_str("<param>");
        parameter.write(out);
        out.push_str("</param>");
    }
    out.push_str("</params>");
}

fn parameters(node: Node<'_, '_>) -> Result<Vec<Value>, String> {
    let values = children(node, "param").map(|param| child(param, "value").ok_or("a parameter has no value"));
    values.map(|node| value(node?, 0)).collect()
}

fn value(node: Node<'_, '_>, depth: usize) -> Result<Value, String> {
    if depth > DEEPEST {
        return Err(format!("values nest more than {DEEPEST} deep"));
    }
    // Text without a type is text.
    let Some(typed) = node.children().find(Node::is_element) else { return Ok(text(node).into()) };
    let content = text(typed);
    match typed.tag_name().name() {
        "int" | "i4" => content.trim().parse().map(Value::Int).map_err(|_| format!("`{content}` is not a number")),
        "boolean" => Ok(Value::Bool(content.trim() == "1")),
        "array" => {
            let data = child(typed, "data").ok_or("an array has no data")?;
            children(data, "value").map(|node| value(node, depth + 1)).collect::<Result<_, _>>().map(Value::List)
        }
        // Structures are in no call of nodes; numbers with a point, times and bytes are of no use here.
        _ => Ok(content.into()),
    }
}

fn text<'a>(node: Node<'a, '_>) -> &'a str {
    node.text().unwrap_or_default()
}

fn child<'a, 'input>(node: Node<'a, 'input>, name: &'static str) -> Option<Node<'a, 'input>> {
    children(node, name).next()
}

fn children<'a, 'input>(
    node: Node<'a, 'input>,
    name: &'static str,
) -> impl Iterator<Item = Node<'a, 'input>> + use<'a, 'input> {
    node.children().filter(move |child| child.has_tag_name(name))
}

fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '&' => escaped.push_str("&amp;"),
            c if c.is_control() && !matches!(c, '\t' | '\n') => escaped.push(char::REPLACEMENT_CHARACTER),
            c => escaped.push(c),
        }
    }
    escaped
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn values() -> impl Strategy<Value = Value> {
        let leaf = prop_oneof![
            any::<i32>().prop_map(Value::Int),
            any::<bool>().prop_map(Value::Bool),
            "[ -~äß€\n\t]{0,20}".prop_map(Value::Text),
        ];
        leaf.prop_recursive(4, 20, 4, |inner| prop::collection::vec(inner, 0..4).prop_map(Value::List))
    }

    proptest! {
        #[test]
        fn calls_and_answers_are_read_as_they_were_written(parameters in prop::collection::vec(values(), 0..4)) {
            let read = read_call(&call("requestTopic", &parameters)).unwrap();
            prop_assert_eq!(read, ("requestTopic".to_owned(), parameters.clone()));
            for value in parameters {
                prop_assert_eq!(read_answer(&answer(value.clone())).unwrap(), value);
            }
        }

        #[test]
        fn any_text_is_a_call_or_a_problem(text: String) {
            let _ = (read_call(&text), read_answer(&text));
        }
    }

    #[test]
    fn what_others_write_is_read() {
        let of_roscpp = "<?xml version=\"1.0\"?>\r\n<methodCall><methodName>publisherUpdate</methodName>\r\n<params><param>\
                         <value>/master</value></param><param><value><array><data><value><i4>1</i4></value></data></array>\
                         </value></param></params></methodCall>\r\n";
        let (method, parameters) = read_call(of_roscpp).unwrap();
        assert_eq!(method, "publisherUpdate");
        assert_eq!(parameters, [Value::from("/master"), Value::List(vec![Value::Int(1)])]);
    }

    #[test]
    fn what_went_wrong_is_said() {
        let fault = "<methodResponse><fault><value><struct><member><name>faultCode</name><value><int>1</int></value>\
                     </member><member><name>faultString</name><value><string>no &lt;such&gt; method</string></value>\
                     </member></struct></value></fault></methodResponse>";
        assert_eq!(read_answer(fault).unwrap_err(), "it reports: faultCode 1 faultString no <such> method");
        assert!(read_answer("<methodResponse>").unwrap_err().starts_with("it is not XML: "));
        assert!(read_answer("<!DOCTYPE a [<!ENTITY b \"c\">]><methodResponse/>").is_err(), "nothing is expanded");
        let deep = format!("{}{}", "<array><data><value>".repeat(50), "</value></data></array>".repeat(50));
        let deep = format!("<methodResponse><params><param><value>{deep}</value></param></params></methodResponse>");
        assert_eq!(read_answer(&deep).unwrap_err(), "values nest more than 20 deep");
    }
}
