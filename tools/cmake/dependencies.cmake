# What the libraries Tubule::common, Tubule::axisym and Tubule::surface3d need; read by our build and by that of those who use them.
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(SUNDIALS 6.4 REQUIRED COMPONENTS idas nvecserial sunmatrixsparse sunlinsolklu)
find_package(SuiteSparse REQUIRED COMPONENTS KLU CHOLMOD UMFPACK)
# Named before SuiteSparse when linking, so that its supernodal kernels use this BLAS, whatever the system's choice is.
set(BLA_VENDOR OpenBLAS)
find_package(BLAS REQUIRED)
find_package(GSL REQUIRED)
find_package(Spectra 1 REQUIRED)
find_package(OpenMP REQUIRED COMPONENTS CXX)
find_package(HDF5 REQUIRED COMPONENTS C)
find_package(tomlplusplus REQUIRED)
find_package(fmt REQUIRED)
