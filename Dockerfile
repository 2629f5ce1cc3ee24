# The four programs in one image: docker build -t polymer-mechanics .
#   docker run --rm -v "$PWD:/work" polymer-mechanics peri run case.toml
FROM rust:1.95-slim-bookworm AS build
RUN apt-get update && apt-get install -y --no-install-recommends gcc libc6-dev && rm -rf /var/lib/apt/lists/*
WORKDIR /source
COPY . .
RUN cargo build --release --locked -p polycore -p peri -p crystfem -p mdsurrogate --bins

FROM debian:bookworm-slim
COPY --from=build /source/target/release/polycore /source/target/release/peri /source/target/release/crystfem \
    /source/target/release/mdsurrogate /usr/local/bin/
COPY --from=build /source/cases /usr/local/share/polymer-mechanics/cases
WORKDIR /work
