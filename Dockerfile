# The four programs in one image, with man pages and licences: docker build -t polymer-mechanics .
#   docker run --rm -v "$PWD:/work" polymer-mechanics peri run case.toml
FROM rust:1.95-slim-bookworm AS build
RUN apt-get update && apt-get install -y --no-install-recommends gcc libc6-dev && rm -rf /var/lib/apt/lists/*
WORKDIR /source
COPY . .
RUN cargo xtask dist --output /dist && mkdir /archive && tar -xzf /dist/*.tar.gz -C /archive --strip-components=1

FROM debian:bookworm-slim
COPY --from=build /archive/bin /usr/local/bin
COPY --from=build /archive/man /usr/local/share/man
COPY --from=build /archive/completions/bash /usr/share/bash-completion/completions
COPY --from=build /archive/README.md /archive/CHANGELOG.md /archive/CITATION.cff /archive/LICENSE-APACHE /archive/LICENSE-MIT \
    /archive/THIRD-PARTY.md /usr/local/share/doc/polymer-mechanics/
COPY --from=build /source/cases /usr/local/share/polymer-mechanics/cases
WORKDIR /work
