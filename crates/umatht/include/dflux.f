!     Latent heat of umatht in CalculiX: link it before the archive, which has an empty dflux. Load the elements by
!     *DFLUX / ELSET, BFNU1010. with their density behind BFNU; *DEPVAR is 4: the fourth state variable is the heat that
!     crystals release per mass and time.
      subroutine dflux(flux,sol,kstep,kinc,time,noel,npt,coords,
     &     jltyp,temp,press,loadtype,area,vold,co,lakonl,konl,
     &     ipompc,nodempc,coefmpc,nmpc,ikmpc,ilmpc,iscale,mi,
     &     sti,xstateini,xstate,nstate_,dtime)
      implicit none
      character*8 lakonl
      character*20 loadtype
      integer kstep,kinc,noel,npt,jltyp,konl(20),ipompc(*),nstate_,
     &     nodempc(3,*),nmpc,ikmpc(*),ilmpc(*),iscale,mi(*),status
      real*8 flux(2),time(2),coords(3),sol,temp,press,vold(0:mi(2),*),
     &     area,co(3,*),coefmpc(*),sti(6,mi(1),*),
     &     xstate(nstate_,mi(1),*),xstateini(nstate_,mi(1),*),dtime,
     &     density
      if (nstate_.lt.4) error stop 'dflux: *DEPVAR of 4 is needed'
      read(loadtype(5:20),*,iostat=status) density
      if (status.ne.0) error stop 'dflux: BFNU and a density expected'
      flux(1)=density*xstate(4,npt,noel)
      end
