# A worker or a scheduler of a farm, with Mesa. docs/farm.md has the lines that build and start it.
FROM debian:bookworm-slim
COPY tools/install-worker dist/*.whl /root/farm/
RUN /root/farm/install-worker /root/farm/*.whl && rm -r /root/farm
ENV PATH=/opt/raytracer/bin:$PATH
# Dask runs whatever it is sent: not as root.
RUN useradd --create-home farm
USER farm
WORKDIR /home/farm
ENTRYPOINT ["dask"]
