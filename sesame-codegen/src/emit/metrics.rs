//! `metrics.rs` (a trait for each hook metric of the space) and `registry.rs` (the hooks of a campaign for the
//! runtime).

use proc_macro2::TokenStream;
use quote::{format_ident, quote};
use sesame_plan::{Direction, Type};

use super::handlers::{handlers, paths};
use super::messages::{self, Messages, TypePaths};
use super::registry::{self, Registered};
use super::rust;
use crate::names;
use crate::plan::{HookPlan, RunnerPlan};

/// Where a metric is declared, for example ``metric `top_speed` (kuka_cell.sesame:31)``.
pub(super) fn declared(hook: &HookPlan) -> String {
    format!("metric `{}` ({}:{})", hook.metric, hook.source, hook.line)
}

/// What kind of number a metric is, in a sentence; nothing for a plain number without a direction.
pub(super) fn meaning(hook: &HookPlan) -> Option<String> {
    let direction = hook.direction.map(|direction| match direction {
        Direction::Maximise => "more is more dangerous",
        Direction::Minimise => "less is more dangerous",
    });
    match (&hook.unit, direction) {
        (Some(unit), Some(direction)) => Some(format!("Its value is in {unit}; {direction}.")),
        (Some(unit), None) => Some(format!("Its value is in {unit}.")),
        (None, Some(direction)) => Some(format!("Its value is a plain number; {direction}.")),
        (None, None) => None,
    }
}

/// The traits that hooks implement.
pub(super) fn traits(runner: &RunnerPlan, types: &Messages<'_>, header: &str) -> String {
    let traits = runner.hooks.iter().map(|hook| hook_trait(runner, types, hook));
    let takes = |what: &dyn Fn(&Type) -> bool| {
        runner.hooks.iter().flat_map(|hook| &hook.inputs).any(|&input| what(&runner.plan.topic(input).ty))
    };
    let context = (!runner.hooks.is_empty()).then(|| quote! { use ::sesame_runtime::metric::Context; });
    let text = takes(&messages::holds_text).then(|| quote! { use ::sesame_runtime::value::Text; });
    let messages =
        takes(&|ty| messages::named_message(ty).is_some()).then(|| quote! { use crate::generated::messages; });
    let docs = rust::module_docs([format!("What the metric hooks of `{}` implement.", runner.plan.space)]);
    rust::file(
        header,
        quote! {
            #docs
            #![allow(dead_code, reason = "a campaign need not measure all metrics of its space")]
            #context
            #text
            #messages
            #(#traits)*
        },
    )
}

fn hook_trait(runner: &RunnerPlan, types: &Messages<'_>, hook: &HookPlan) -> TokenStream {
    let name = names::ident(&names::hook_trait(&hook.metric));
    let (hook_type, file) = (names::hook_type(&hook.metric), names::snake(&hook.metric));
    let declared = declared(hook);
    let message = rust::as_format(&format!("{declared} has no hook"));
    let label = format!("`{hook_type}` does not implement `{name}`");
    let note = rust::as_format(&format!(
        "hooks/{file}.rs holds the hook: write `impl {name} for {hook_type}` there, \
         or move the file away and run `sesamec generate {}` for a fresh stub",
        runner.plan.source
    ));
    let mut doc: Vec<String> = hook.doc.lines().map(str::to_owned).collect();
    if !doc.is_empty() {
        doc.push(String::new());
    }
    doc.push(format!("The hook of {declared}; one is made for each run."));
    doc.extend(meaning(hook));
    let docs = rust::docs(doc);

    let handlers = handlers(&runner.plan, &hook.inputs).into_iter().map(|handler| {
        let mut doc = vec![format!("A message on `{}` (\"{}\").", handler.topic.name, paths(handler.topic))];
        doc.extend(messages::unit(&handler.topic.ty).map(|unit| format!("In {unit}.")));
        if !handler.topic.doc.is_empty() {
            doc.push(String::new());
            doc.extend(handler.topic.doc.lines().map(str::to_owned));
        }
        let docs = rust::docs(doc);
        let (method, parameter) = (names::ident(&handler.method), names::ident(&handler.parameter));
        let ty = messages::tokens(&types.borrowed(&handler.topic.ty, TypePaths::BY_MODULE));
        quote! { #docs fn #method(&mut self, #parameter: #ty, ctx: &mut Context); }
    });
    quote! {
        #docs
        #[diagnostic::on_unimplemented(message = #message, label = #label, note = #note)]
        pub trait #name: ::core::default::Default {
            /// Before the first message of a run.
            fn on_start(&mut self, ctx: &mut Context) { let _ = ctx; }
            #(#handlers)*
            /// After the last message of a run.
            fn on_end(&mut self, ctx: &mut Context) { let _ = ctx; }
        }
    }
}

/// The hooks this campaign uses: their files, and what makes the runtime call them.
///
/// `hooks` is where the hook files are, as seen from the file's folder.
pub(super) fn registry(runner: &RunnerPlan, types: &Messages<'_>, header: &str, hooks: &str) -> String {
    let used: Vec<&HookPlan> = runner.hooks.iter().filter(|hook| runner.uses(hook)).collect();
    let registered: Vec<Registered<'_>> =
        used.iter().map(|hook| Registered { name: &hook.metric, declared: declared(hook) }).collect();
    let adapters = used.iter().map(|hook| adapter(runner, types, hook));
    let docs = rust::module_docs([format!("The metric hooks of `{}`, for the runtime.", runner.plan.campaign.name)]);
    registry::registry(header, &docs, hooks, &registered, |registered| {
        let entries = used.iter().zip(registered).map(|(hook, here)| {
            let (metric, build) = (&hook.metric, build(hook));
            quote! { ::sesame_runtime::metric::HookEntry { metric: #metric, build: #build::<#here> } }
        });
        quote! {
            /// One entry for each hook metric of this campaign.
            pub(super) static HOOKS: &[::sesame_runtime::metric::HookEntry] = &[#(#entries),*];
            #(#adapters)*
        }
    })
}

fn build(hook: &HookPlan) -> proc_macro2::Ident {
    format_ident!("build_{}", names::snake(&hook.metric))
}

/// Turns dynamic messages into typed ones for a hook.
fn adapter(runner: &RunnerPlan, types: &Messages<'_>, hook: &HookPlan) -> TokenStream {
    let adapter = format_ident!("{}Adapter", names::hook_type(&hook.metric));
    let hook_trait = names::ident(&names::hook_trait(&hook.metric));
    let hook_trait = quote! { crate::generated::metrics::#hook_trait };
    let build = build(hook);
    let arms = (0_usize..).zip(handlers(&runner.plan, &hook.inputs)).map(|(input, handler)| {
        let method = names::ident(&handler.method);
        let argument = match &handler.topic.ty {
            Type::Bool | Type::Int { .. } | Type::Real { .. } | Type::Point { .. } => quote! { message },
            Type::Text | Type::List { .. } | Type::Message { .. } => quote! { &message },
        };
        let ty = messages::tokens(&types.owned(&handler.topic.ty, TypePaths::WHOLE));
        quote! {
            #input => match <#ty as ::sesame_runtime::message::FromValue>::from_value(value) {
                ::core::result::Result::Ok(message) => #hook_trait::#method(&mut self.0, #argument, ctx),
                ::core::result::Result::Err(mismatch) => ctx.mismatch(&mismatch),
            }
        }
    });
    let beyond = format!("metric `{}` has no such input", hook.metric);
    quote! {
        struct #adapter<H>(H);

        fn #build<H: #hook_trait + 'static>(_: &str) -> ::std::boxed::Box<dyn ::sesame_runtime::metric::Hook> {
            ::std::boxed::Box::new(#adapter(<H as ::core::default::Default>::default()))
        }

        impl<H: #hook_trait> ::sesame_runtime::metric::Hook for #adapter<H> {
            fn on_start(&mut self, ctx: &mut ::sesame_runtime::metric::Context) {
                #hook_trait::on_start(&mut self.0, ctx);
            }

            fn on_message(
                &mut self,
                input: usize,
                value: &::sesame_runtime::value::Value,
                ctx: &mut ::sesame_runtime::metric::Context,
            ) {
                match input {
                    #(#arms)*
                    _ => ::core::unreachable!(#beyond),
                }
            }

            fn on_end(&mut self, ctx: &mut ::sesame_runtime::metric::Context) {
                #hook_trait::on_end(&mut self.0, ctx);
            }
        }
    }
}
