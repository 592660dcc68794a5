MODULE pickplace
  PERS tooldata RmpTool:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];
  PERS wobjdata RmpFrame:=[FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  VAR num good;
  VAR robtarget RmpHit;
  CONST jointtarget p_home:=[[0,-90,90,0,90,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p_pick:=[[550,-300,120],[0,0,1,0],[0,0,0,2],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST robtarget p_place:=[[550,300,80],[0,-0.707106781,0.707106781,0],[0,0,0,2],[9E9,9E9,9E9,9E9,9E9,9E9]];

  PROC main()
    ConfJ\Off;
    ConfL\Off;
    good:=0;
    MoveAbsJ p_home,[5000,500,5000,1000],fine,RmpTool\WObj:=RmpFrame;
    WHILE good<5 DO
      SetGO go10_4,1;
      WaitUntil (DInput(di1)=1)=TRUE;
      MoveJ RmpTarget([[550,-300,200],[0,0,1,0]]),[3000,300,5000,1000],[FALSE,40,60,60,6,60,6],RmpTool\WObj:=RmpFrame;
      MoveL p_pick,[80,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
      SetDO do3,1;
      WaitTime 0.25;
      MoveL Offs(CRobT(\Tool:=RmpTool\WObj:=RmpFrame),0,0,80),[200,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
      MoveL RmpTarget([[550,300,160],[0,-0.707106781,0.707106781,0]]),[400,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
      SearchL\SStop,di2,RmpHit,p_place,[80,90,5000,1000],RmpTool\WObj:=RmpFrame;
      SetDO do3,0;
      WaitTime 0.25;
      MoveL Offs(CRobT(\Tool:=RmpTool\WObj:=RmpFrame),0,0,80),[250,90,5000,1000],fine,RmpTool\WObj:=RmpFrame;
      good:=good+1;
    ENDWHILE
    SetGO go10_4,0;
    MoveAbsJ p_home,[5000,500,5000,1000],fine,RmpTool\WObj:=RmpFrame;
  ERROR
    IF ERRNO=ERR_WHLSEARCH OR ERRNO=ERR_SIGSUPSEARCH TRYNEXT;
  ENDPROC

  LOCAL FUNC robtarget RmpTarget(pose p)
    VAR robtarget t;
    t:=CRobT(\Tool:=RmpTool\WObj:=RmpFrame);
    t.trans:=p.trans;
    t.rot:=p.rot;
    RETURN t;
  ENDFUNC
ENDMODULE
