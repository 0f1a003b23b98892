//! `operations.rs` (parameters and a trait for each custom operation of the space), `operation_registry.rs` (the hooks
//! of a campaign for the runtime), and the stubs of these hooks.

use proc_macro2::TokenStream;
use quote::quote;
use serde::Serialize;
use sesame_plan::{Domain, Parameter, Topic, Type};

use super::handlers::{self, Handler, handler, paths};
use super::messages::{self, Messages, TypePaths};
use super::problem::Problem;
use super::registry::{self, Registered};
use super::rust::{self, one_line};
use super::text::Templates;
use crate::names::{self, Scope};
use crate::plan::{Called, Offline, OperationPlan, RunnerPlan};

/// Where an operation is declared, for example ``operation `bend_path` (kuka_cell.sesame:41)``.
pub(super) fn declared(operation: &OperationPlan) -> String {
    format!("operation `{}` ({}:{})", operation.operation, operation.source, operation.line)
}

/// The function of a hook.
struct Call<'a> {
    method: String,
    takes: Takes<'a>,
}

/// What the function of a hook is called with.
enum Takes<'a> {
    /// A message of this topic, and the name of the parameter.
    Message(&'a Topic, String),
    /// The run.
    Run(Offline),
}

fn call<'a>(runner: &'a RunnerPlan, operation: &OperationPlan) -> Call<'a> {
    match operation.called {
        Called::OnMessage(topic) => {
            let Handler { topic, method, parameter } = handler(&runner.plan, topic);
            Call { method, takes: Takes::Message(topic, parameter) }
        }
        Called::Offline(moment) => {
            let method = match moment {
                Offline::BeforeStart => "before_start",
                Offline::AfterEnd => "after_end",
            };
            Call { method: method.to_owned(), takes: Takes::Run(moment) }
        }
    }
}

/// The type of a parameter in Rust.
fn parameter_type(parameter: &Parameter, text: &str) -> String {
    match &parameter.domain {
        Domain::Number { integer: true, .. } => "i64".to_owned(),
        Domain::Number { integer: false, .. } => "f64".to_owned(),
        Domain::Point { .. } => "[f64; 3]".to_owned(),
        Domain::Texts { .. } | Domain::Files { .. } => format!("{text}Text"),
    }
}

/// Parameters with their names in Rust.
fn fields(operation: &OperationPlan) -> Vec<(&Parameter, &str, String)> {
    let mut scope = Scope::default();
    let named = operation
        .parameters
        .iter()
        .map(|(parameter, doc)| (parameter, doc.as_str(), scope.take(names::snake(&parameter.name), "_")));
    named.collect()
}

/// What a parameter may be, in a sentence.
pub(super) fn permitted(parameter: &Parameter) -> String {
    let unit = parameter.unit.as_ref().map(|unit| format!(" In {unit}.")).unwrap_or_default();
    match &parameter.domain {
        Domain::Number { low, high, .. } => format!("From {low} to {high}.{unit}"),
        Domain::Point { low, high } => format!("From {low:?} to {high:?}.{unit}"),
        Domain::Texts { texts } => format!("One of {}.", texts.join(", ")),
        Domain::Files { files } => {
            format!("One of the files {}; relative to the folder of the space.", files.join(", "))
        }
    }
}

/// What a hook is given, as [`handlers::inputs`] says it.
pub(super) fn inputs(runner: &RunnerPlan, types: &Messages<'_>, operation: &OperationPlan) -> Vec<String> {
    let mut lines = match operation.called {
        Called::OnMessage(topic) => handlers::inputs(&runner.plan, types, &[topic]),
        Called::Offline(_) => vec![call(runner, operation).method],
    };
    for (parameter, _, name) in fields(operation) {
        let unit = parameter.unit.as_ref().map(|unit| format!(" in {unit}")).unwrap_or_default();
        lines.push(format!("parameters.{name}: {}{unit}", parameter_type(parameter, "")));
    }
    lines
}

/// The parameters and traits.
pub(super) fn traits(runner: &RunnerPlan, types: &Messages<'_>, header: &str) -> String {
    let traits = runner.operations.iter().map(|operation| hook_trait(runner, types, operation));
    let docs = rust::module_docs([format!("What the operation hooks of `{}` implement.", runner.plan.space)]);
    rust::file(
        header,
        quote! {
            #docs
            #![allow(dead_code, reason = "a campaign need not use all operations of its space")]
            #(#traits)*
        },
    )
}

fn hook_trait(runner: &RunnerPlan, types: &Messages<'_>, operation: &OperationPlan) -> TokenStream {
    let (hook_type, file) = (names::hook_type(&operation.operation), names::snake(&operation.operation));
    let name = names::ident(&names::hook_trait(&operation.operation));
    let parameters = names::ident(&names::parameters_type(&operation.operation));
    let declared = declared(operation);
    let message = rust::as_format(&format!("{declared} has no hook"));
    let label = format!("`{hook_type}` does not implement `{name}`");
    let note = rust::as_format(&format!(
        "hooks/{file}.rs holds the hook: write `impl {name} for {hook_type}` there, \
         or move the file away and run `sesamec generate {}` for a fresh stub",
        runner.plan.source
    ));
    let mut doc: Vec<String> = operation.doc.lines().map(str::to_owned).collect();
    if !doc.is_empty() {
        doc.push(String::new());
    }
    doc.push(format!("The hook of {declared}; one is made for each use in a test, and for each run."));
    let docs = rust::docs(doc);
    let parameter_docs = rust::docs([format!("What a test chose for `{}`.", operation.operation)]);
    let struct_fields = fields(operation).into_iter().map(|(parameter, doc, name)| {
        let docs = rust::docs(doc.lines().map(str::to_owned).chain([permitted(parameter)]));
        let (name, ty) =
            (names::ident(&name), messages::tokens(&parameter_type(parameter, "::sesame_runtime::value::")));
        quote! { #docs pub #name: #ty }
    });
    let Call { method, takes } = call(runner, operation);
    let method = names::ident(&method);
    let method = match takes {
        Takes::Message(topic, parameter) => {
            let mut doc = vec![format!("A message on `{}` (\"{}\"), to be changed.", topic.name, paths(topic))];
            doc.extend(messages::unit(&topic.ty).map(|unit| format!("In {unit}.")));
            let docs = rust::docs(doc);
            let parameter = names::ident(&parameter);
            let ty = messages::tokens(&types.owned(&topic.ty, TypePaths::WHOLE));
            quote! {
                #docs
                fn #method(
                    &mut self,
                    #parameter: &mut #ty,
                    parameters: &#parameters,
                    ctx: &mut ::sesame_runtime::fuzz::OperationContext<'_, #ty>,
                );
            }
        }
        Takes::Run(moment) => {
            let docs = rust::docs([match moment {
                Offline::BeforeStart => "Before the simulator starts afresh for the run.",
                Offline::AfterEnd => "After the last message of a run that came to its end.",
            }]);
            quote! {
                #docs
                fn #method(&mut self, parameters: &#parameters, ctx: &mut ::sesame_runtime::fuzz::RunContext<'_>);
            }
        }
    };
    quote! {
        #parameter_docs
        #[derive(Debug, Clone, PartialEq)]
        pub struct #parameters { #(#struct_fields,)* }

        #docs
        #[diagnostic::on_unimplemented(message = #message, label = #label, note = #note)]
        pub trait #name: ::core::default::Default {
            #method
        }
    }
}

/// The hooks this campaign uses: their files, and what makes the runtime call them.
///
/// `hooks` is where the hook files are, as seen from the file's folder.
pub(super) fn registry(runner: &RunnerPlan, types: &Messages<'_>, header: &str, hooks: &str) -> String {
    let used: Vec<&OperationPlan> = runner.operations.iter().filter(|operation| runner.applies(operation)).collect();
    let registered: Vec<Registered<'_>> =
        used.iter().map(|operation| Registered { name: &operation.operation, declared: declared(operation) }).collect();
    let adapters = used.iter().map(|operation| adapter(runner, types, operation));
    let docs = rust::module_docs([format!("The operation hooks of `{}`, for the runtime.", runner.plan.campaign.name)]);
    registry::registry(header, &docs, hooks, &registered, |registered| {
        let entries = used.iter().zip(registered).map(|(operation, here)| {
            let (name, build) = (&operation.operation, build(operation));
            quote! { ::sesame_runtime::fuzz::OperationEntry { operation: #name, build: #build::<#here> } }
        });
        quote! {
            /// One entry for each custom operation of this campaign.
            pub(super) static OPERATIONS: &[::sesame_runtime::fuzz::OperationEntry] = &[#(#entries),*];
            #(#adapters)*
        }
    })
}

fn build(operation: &OperationPlan) -> proc_macro2::Ident {
    quote::format_ident!("build_{}", names::snake(&operation.operation))
}

/// Turns choices into typed parameters and dynamic messages into typed ones for a hook.
fn adapter(runner: &RunnerPlan, types: &Messages<'_>, operation: &OperationPlan) -> TokenStream {
    let adapter = quote::format_ident!("{}Adapter", names::hook_type(&operation.operation));
    let hook_trait = names::ident(&names::hook_trait(&operation.operation));
    let hook_trait = quote! { crate::generated::operations::#hook_trait };
    let parameters = names::ident(&names::parameters_type(&operation.operation));
    let parameters = quote! { crate::generated::operations::#parameters };
    let build = build(operation);
    let read = (0_usize..).zip(fields(operation)).map(|(position, (_, _, name))| {
        let name = names::ident(&name);
        quote! { #name: ::sesame_runtime::fuzz::chosen(choices, #position) }
    });
    let unused = operation.parameters.is_empty().then(|| quote! { let _ = choices; });
    let Call { method, takes } = call(runner, operation);
    let method = names::ident(&method);
    let called = match takes {
        Takes::Message(topic, _) => {
            let ty = messages::tokens(&types.owned(&topic.ty, TypePaths::WHOLE));
            quote! {
                fn on_message(
                    &mut self,
                    message: &mut ::sesame_runtime::value::Value,
                    call: &mut ::sesame_runtime::fuzz::MessageCall<'_>,
                ) {
                    call.typed::<#ty>(message, |message, ctx| {
                        #hook_trait::#method(&mut self.hook, message, &self.parameters, ctx);
                    });
                }
            }
        }
        Takes::Run(_) => {
            quote! {
                fn before_or_after_run(&mut self, ctx: &mut ::sesame_runtime::fuzz::RunContext<'_>) {
                    #hook_trait::#method(&mut self.hook, &self.parameters, ctx);
                }
            }
        }
    };
    quote! {
        struct #adapter<H> {
            hook: H,
            parameters: #parameters,
        }

        fn #build<H: #hook_trait + 'static>(
            _: &str,
            choices: &[::sesame_runtime::plan::Choice],
        ) -> ::std::boxed::Box<dyn ::sesame_runtime::fuzz::OperationHook> {
            #unused
            ::std::boxed::Box::new(#adapter {
                hook: <H as ::core::default::Default>::default(),
                parameters: #parameters { #(#read,)* },
            })
        }

        impl<H: #hook_trait> ::sesame_runtime::fuzz::OperationHook for #adapter<H> {
            #called
        }
    }
}

#[derive(Serialize)]
struct Stub {
    doc: Vec<String>,
    operation: String,
    space: String,
    source: String,
    line: u32,
    imports: Vec<String>,
    hook_type: String,
    hook_trait: String,
    parameters_type: String,
    method: String,
    /// Said of the function.
    when: String,
    /// The message's name and type, with `: &mut` between; none beside the run.
    message: Option<StubMessage>,
    context: String,
    example: String,
}

#[derive(Serialize)]
struct StubMessage {
    name: String,
    ty: String,
}

/// The stub of a hook.
pub(super) fn stub(
    templates: &Templates,
    runner: &RunnerPlan,
    types: &Messages<'_>,
    operation: &OperationPlan,
) -> Result<String, Problem> {
    let (hook_type, hook_trait) = (names::hook_type(&operation.operation), names::hook_trait(&operation.operation));
    let parameters_type = names::parameters_type(&operation.operation);
    let Call { method, takes } = call(runner, operation);
    let mut own = [names::written(&hook_trait), parameters_type.clone()];
    own.sort();
    let mut imports = vec![format!("crate::generated::operations::{{{}}}", own.join(", "))];
    let (message, when, context, example) = match takes {
        Takes::Message(topic, name) => {
            let of = messages::named_message(&topic.ty).map(|id| types.struct_name(id).to_owned());
            // A message called like the hook or its parameters is reached through its module.
            let clash = of.as_ref().is_some_and(|of| [&hook_type, &hook_trait, &parameters_type].contains(&of));
            imports.extend(of.map(|of| {
                if clash {
                    "crate::generated::messages".to_owned()
                } else {
                    format!("crate::generated::messages::{}", names::written(&of))
                }
            }));
            imports.push("sesame_runtime::fuzz::OperationContext".to_owned());
            if messages::holds_text(&topic.ty) {
                imports.push("sesame_runtime::value::Text".to_owned());
            }
            let ty = types.owned(&topic.ty, if clash { TypePaths::BY_MODULE } else { TypePaths::IMPORTED });
            let message = StubMessage { name: names::written(&name), ty };
            let unit = messages::unit(&topic.ty).map(|unit| format!("; in {unit}")).unwrap_or_default();
            let when = format!("A message on `{}` (\"{}\"), to be changed{unit}.", topic.name, paths(topic));
            let example = match &topic.ty {
                Type::Real { .. } => format!("*{} += ctx.draw_between(-0.1, 0.1);", message.name),
                _ => format!("if ctx.draw() < 0.1 {{ ctx.inject({}.clone()); }}", message.name),
            };
            let context = format!("OperationContext<'_, {}>", message.ty);
            (Some(message), when, context, example)
        }
        Takes::Run(moment) => {
            imports.push("sesame_runtime::fuzz::RunContext".to_owned());
            let when = match moment {
                Offline::BeforeStart => {
                    "Before the simulator starts afresh for the run. Changed files are put back after it."
                }
                Offline::AfterEnd => "After the last message of a run that came to its end.",
            };
            let example = "ctx.edit_file(\"config.yaml\", |text| text.replace(\"gain: 1\", \"gain: 2\"));";
            (None, when.to_owned(), "RunContext<'_>".to_owned(), example.to_owned())
        }
    };
    imports.sort();
    let stub = Stub {
        doc: operation.doc.lines().map(one_line).collect(),
        operation: operation.operation.clone(),
        space: runner.plan.space.clone(),
        source: one_line(&operation.source),
        line: operation.line,
        imports,
        hook_type: names::written(&hook_type),
        hook_trait: names::written(&hook_trait),
        parameters_type,
        method: names::written(&method),
        when: one_line(&when),
        message,
        context,
        example,
    };
    templates.render("runner/operation_hook.rs.tera", &stub)
}
